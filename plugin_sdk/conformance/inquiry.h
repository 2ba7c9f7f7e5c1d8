// How a case judges: it asks, demands an answer or a refusal, and compares with what is right. What does not hold
// ends the case with a Finding, whose text carries the numbers: what was asked, what came, what was right.
//
//   const Case one = make_case("integrator/rest", "Bodies at rest stay where they are.", [](Subject& subject) {
//     Inquiry inquiry(subject, "3 bodies at rest, no wrench");
//     const MessageColumns reply = inquiry.answer(stage::Method::kIntegratorIntegrate, request);
//     inquiry.expect_near("position of body 0", vector_at(reply.f64("position"), 0), start, 0.0);
//   });
#pragma once

#include <functional>
#include <optional>
#include <span>
#include <stdexcept>
#include <string>
#include <vector>

#include "plugin_sdk/conformance/conformance.h"
#include "plugin_sdk/math/types.h"
#include "plugin_sdk/property_value.h"

namespace gravitas::conformance {

// The claim of a case does not hold, and why.
class Finding : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

// The subject refused, with a reason, what it must answer.
class Refused : public Finding {
 public:
  using Finding::Finding;
};

// A case whose judge throws a Finding where the claim fails.
Case make_case(std::string name, std::string claim, std::function<void(Subject&)> judge);
// One that asks with drawn values of properties that need not be given, too (vary() of sample_values.h), which may be refused in
// any state: then it asks again without. What is refused among others must be refused alone, too: Inquiry::answer_rows().
Case make_varied_case(std::string name, std::string claim, std::function<void(Subject&, bool varies)> judge);

// A request with every single value zero and no rows.
MessageColumns empty_request(stage::Method method);
MessageColumns empty_reply(stage::Method method);

void append(std::vector<double>* column, const Vector3& v);
void append(std::vector<double>* column, const Quaternion& q);

std::string shown(const Vector3& v);
std::string shown(const Quaternion& q);

inline bool is_refusal(const Answer& answer) { return answer.fault.empty() && answer.status == GRAVITAS_REFUSED; }

class Inquiry {
 public:
  // `asked`: the question in words; stands in front of every finding.
  Inquiry(Subject& subject, std::string asked) : subject_(subject), asked_(std::move(asked)) {}

  void now_asked(std::string asked) { asked_ = std::move(asked); }
  const PluginDeclaration& declaration() const { return subject_.declaration(); }
  // For questions that come to the same as one that has been answered: a refusal is a finding like any other.
  Inquiry demanding_answers() const;

  // The answer, which must be GRAVITAS_OK and hold finite numbers only.
  MessageColumns answer(stage::Method method, const MessageColumns& request, const DerivativeFunction& derivative = {});
  // The same of a question of many rows, which may be refused only where one of these alone is; `alone` asks row by row.
  MessageColumns answer_rows(stage::Method method, const MessageColumns& request, std::size_t rows,
                             const std::function<MessageColumns(std::size_t)>& alone);
  // As answer() for hostile questions, where GRAVITAS_REFUSED with a reason is as good: nothing then.
  std::optional<MessageColumns> answer_or_refusal(stage::Method method, const MessageColumns& request,
                                                  const DerivativeFunction& derivative = {});
  // Demands GRAVITAS_REFUSED with a reason.
  void demand_refusal(stage::Method method, const MessageColumns& request, const DerivativeFunction& derivative = {});

  [[noreturn]] void fail(const std::string& text) const;
  void expect(bool holds, const std::string& otherwise) const;
  // Within the tolerance; not so if anything is NaN.
  void expect_near(const std::string& what, double came, double right, double tolerance) const;
  void expect_near(const std::string& what, const Vector3& came, const Vector3& right, double tolerance) const;
  // As attitudes: q and -q are the same; the tolerance is that of the angle, rad.
  void expect_near(const std::string& what, const Quaternion& came, const Quaternion& right, double tolerance) const;
  void expect_at_most(const std::string& what, double came, double most) const;
  // Number by number equal; 0 equals -0.
  void expect_equal(const std::string& what, std::span<const double> came, std::span<const double> right) const;
  void expect_equal(const std::string& what, std::span<const std::uint32_t> came,
                    std::span<const std::uint32_t> right) const;
  // Rows of `components` numbers that are unit as the kernel demands it.
  void expect_unit(const std::string& what, std::span<const double> column, std::size_t components) const;

 private:
  Answer ask(stage::Method method, const MessageColumns& request, const DerivativeFunction& derivative);
  void expect_finite(stage::Method method, const MessageColumns& reply) const;

  Subject& subject_;
  std::string asked_;
  bool may_be_refused_ = true;
};

}  // namespace gravitas::conformance
