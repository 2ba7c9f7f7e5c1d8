// What the kit says of a subject that answers as a test tells it: each finding carries the numbers.
#include "plugin_sdk/conformance/inquiry.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "plugin_sdk/conformance/hostile_numbers.h"
#include "plugin_sdk/math/rotation.h"

namespace gravitas::conformance {
namespace {

using testing::HasSubstr;

constexpr stage::Method kWrenches = stage::Method::kForceWrenches;

// Answers every question with the same answer, and remembers how often.
class Parrot final : public Subject {
 public:
  Answer answer{.status = GRAVITAS_OK, .text = {}, .fault = {}, .columns = empty_reply(kWrenches)};
  int asked = 0;
  // Refuses requests with a number that is not finite, or an index beyond the bodies.
  bool is_careful = false;

  const PluginDeclaration& declaration() const override { return declaration_; }
  Answer ask(stage::Method, const MessageColumns& request, const DerivativeFunction&) override {
    ++asked;
    if (is_careful && is_spoiled(request)) {
      Answer refusal = answer;
      refusal.status = GRAVITAS_REFUSED, refusal.text = "no";
      return refusal;
    }
    return answer;
  }

 private:
  static bool is_spoiled(const MessageColumns& request) {
    for (const double mass : request.f64("mass"))
      if (!std::isfinite(mass)) return true;
    for (const std::uint32_t index : request.u32("application"))
      if (index > 10) return true;
    return request.u32("force_parameter_begin")[0] > 10;
  }

  PluginDeclaration declaration_;
};

std::string finding_of(const std::function<void(Inquiry&)>& judge, Parrot* parrot) {
  return make_case("a/b", "Claim.",
                   [&](Subject& subject) {
                     Inquiry inquiry(subject, "asked");
                     judge(inquiry);
                   })
      .judge(*parrot);
}

MessageColumns good_request() {
  MessageColumns request = empty_request(kWrenches);
  request.u32("force_parameter_begin") = {0};
  request.u32("application") = {0, 0};
  request.f64("mass") = {2.0};
  return request;
}

TEST(Inquiry, TakesAnAnswer) {
  Parrot parrot;
  EXPECT_EQ(finding_of([](Inquiry& inquiry) { inquiry.answer(kWrenches, good_request()); }, &parrot), "");
  EXPECT_EQ(parrot.asked, 1);
}

TEST(Inquiry, TellsNumbersThatAreNotFinite) {
  Parrot parrot;
  parrot.answer.columns.f64("potential") = {1.0, std::numeric_limits<double>::infinity()};
  const auto judge = [](Inquiry& inquiry) { inquiry.answer_or_refusal(kWrenches, good_request()); };
  EXPECT_THAT(finding_of(judge, &parrot), HasSubstr("asked: answered inf in potential, row 1"));
}

TEST(Inquiry, TellsRefusalsFailuresAndDeathsApart) {
  Parrot parrot;
  const auto must = [](Inquiry& inquiry) { inquiry.answer(kWrenches, good_request()); };
  const auto may = [](Inquiry& inquiry) { EXPECT_FALSE(inquiry.answer_or_refusal(kWrenches, good_request())); };
  const auto must_not = [](Inquiry& inquiry) { inquiry.demand_refusal(kWrenches, good_request()); };
  EXPECT_THAT(finding_of(must_not, &parrot), HasSubstr("must be refused (GRAVITAS_REFUSED and a reason); came: OK"));

  parrot.answer.status = GRAVITAS_REFUSED, parrot.answer.text = "too heavy";
  EXPECT_THAT(finding_of(must, &parrot), HasSubstr("came: REFUSED (too heavy)"));
  EXPECT_EQ(finding_of(may, &parrot), "");
  EXPECT_EQ(finding_of(must_not, &parrot), "");

  parrot.answer.text.clear();
  EXPECT_THAT(finding_of(may, &parrot), HasSubstr("without a reason"));
  EXPECT_THAT(finding_of(must_not, &parrot), HasSubstr("without a reason"));

  parrot.answer.status = GRAVITAS_FAILED;
  EXPECT_THAT(finding_of(may, &parrot), HasSubstr("came: FAILED"));
  parrot.answer.status = GRAVITAS_REFUSED, parrot.answer.text = "no";
  parrot.answer.fault = "it died of signal 11";
  EXPECT_THAT(finding_of(may, &parrot), HasSubstr("came: it died of signal 11"));
  EXPECT_THAT(finding_of(must_not, &parrot), HasSubstr("came: it died of signal 11"));
}

TEST(Inquiry, ComparesWithinTheTolerance) {
  Parrot parrot;
  const auto near = [&](double came, double tolerance) {
    return finding_of([=](Inquiry& inquiry) { inquiry.expect_near("depth", came, 0.5, tolerance); }, &parrot);
  };
  EXPECT_EQ(near(0.75, 0.25), "");
  EXPECT_EQ(near(0.75, 0.125), "asked: depth is 0.75, should be 0.5 (within 0.125)");
  EXPECT_THAT(near(std::nan(""), 1e300), HasSubstr("depth is nan"));

  const auto vectors = [](Inquiry& inquiry) {
    inquiry.expect_near("force", Vector3(1, 2, 3), Vector3(1, 2, 3), 0.0);
    inquiry.expect_near("force", Vector3(1, 2, 3), Vector3(1, 2, 4), 0.5);
  };
  EXPECT_EQ(finding_of(vectors, &parrot), "asked: force is (1, 2, 3), should be (1, 2, 4) (within 0.5)");
}

TEST(Inquiry, AttitudesOfEitherSignAreTheSame) {
  Parrot parrot;
  const Quaternion q = exp_rotation(Vector3(0.1, 0.2, 0.3));
  const Quaternion minus(-q.w(), -q.x(), -q.y(), -q.z());
  EXPECT_EQ(finding_of([&](Inquiry& inquiry) { inquiry.expect_near("attitude", minus, q, 1e-15); }, &parrot), "");
  const Quaternion turned = rotate_by(q, Vector3(0, 0, 0.25));
  EXPECT_THAT(finding_of([&](Inquiry& inquiry) { inquiry.expect_near("attitude", turned, q, 0.24); }, &parrot),
              HasSubstr("rad apart (within 0.24)"));
}

TEST(Inquiry, NamesTheNumberThatDiffers) {
  Parrot parrot;
  const std::vector<double> one = {1, 0, 3}, other = {1, -0.0, 3}, third = {1, 0, 4}, shorter = {1};
  const auto equal = [&](const std::vector<double>& came) {
    return finding_of([&](Inquiry& inquiry) { inquiry.expect_equal("wrench", came, one); }, &parrot);
  };
  EXPECT_EQ(equal(other), "");
  EXPECT_EQ(equal(third), "asked: wrench number 2 is 4, should be 3 exactly");
  EXPECT_EQ(equal(shorter), "asked: wrench has 1 number, should have 3");
}

TEST(Inquiry, NamesTheRowThatIsNotUnit) {
  Parrot parrot;
  const std::vector<double> rows = {1, 0, 0, 0, 2, 0};
  EXPECT_EQ(finding_of([&](Inquiry& inquiry) { inquiry.expect_unit("normal", rows, 3); }, &parrot),
            "asked: normal of row 1 has norm 2, should have 1");
}

TEST(HostileNumbers, ReachEveryColumnAndNameTheElement) {
  Parrot parrot;
  parrot.answer.columns.f64("potential") = {std::nan("")};
  const Case hostile = make_case("a/b", "Claim.", [](Subject& subject) {
    expect_hostile_numbers_survived(subject, "one body", kWrenches, good_request());
  });
  EXPECT_THAT(hostile.judge(parrot), HasSubstr("one body, with nan in time, row 0: answered nan in potential"));
  parrot.answer.columns.f64("potential").clear();
  parrot.asked = 0;
  EXPECT_EQ(hostile.judge(parrot), "");
  // eight numbers each for the time and the mass
  EXPECT_EQ(parrot.asked, 16);
}

TEST(HostileNumbers, ForeignIndicesMustBeRefused) {
  Parrot parrot;
  const Case foreign = make_case("a/b", "Claim.", [](Subject& subject) {
    expect_foreign_indices_refused(subject, "one body", kWrenches, good_request());
  });
  EXPECT_THAT(foreign.judge(parrot), HasSubstr("one body, with 1000000 in force_parameter_begin, row 0"));
  parrot.is_careful = true;
  parrot.asked = 0;
  EXPECT_EQ(foreign.judge(parrot), "");
  EXPECT_EQ(parrot.asked, 3);
}

}  // namespace
}  // namespace gravitas::conformance
