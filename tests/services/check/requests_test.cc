// Requests made from ordinary ones: wrong ones in the way they say, large ones without a wrong index.
#include <gtest/gtest.h>

#include "plugin_sdk/checks.h"
#include "plugin_sdk/conformance/inquiry.h"
#include "services/check/abused_requests.h"
#include "services/check/large_question.h"

namespace gravitas::check {
namespace {

using conformance::Question;

constexpr stage::Method kWrenches = stage::Method::kForceWrenches;

// One force with two numbers on both of two bodies.
Question force_question() {
  MessageColumns request = conformance::empty_request(kWrenches);
  request.u64("force_type") = {7};
  request.u32("force_parameter_begin") = {0, 2};
  request.f64("force_parameter") = {1.0, 2.0};
  request.u32("application") = {0, 0, 0, 1};
  request.f64("mass") = {1.0, 2.0};
  request.u32("body_shape") = {0, 0};
  request.u64("shape_type") = {9};
  request.u32("shape_parameter_begin") = {0, 1};
  request.f64("shape_parameter") = {0.5};
  for (const char* name : {"geometry_position", "position", "linear_velocity", "angular_velocity"})
    request.f64(name).resize(6);
  for (const char* name : {"geometry_orientation", "orientation"}) request.f64(name) = {1, 0, 0, 0, 1, 0, 0, 0};
  return {"one force on two bodies", kWrenches, request, {}};
}

std::string problem_of(const MessageColumns& request) {
  return check_rows(stage::method_info(kWrenches), request.counts(), {});
}

TEST(AbusedRequests, UnevenRowsAreUnevenAndTheOthersAreNot) {
  const Question question = force_question();
  ASSERT_EQ(problem_of(question.request), "");
  const std::vector<AbusedRequest> uneven = with_uneven_rows(question);
  EXPECT_GT(uneven.size(), 10U);
  for (const AbusedRequest& one : uneven) EXPECT_NE(problem_of(one.request), "") << one.what;
  for (const AbusedRequest& one : with_wild_indices(question)) EXPECT_EQ(problem_of(one.request), "") << one.what;
  const MessageColumns nothing = with_no_rows(question).request;
  EXPECT_EQ(problem_of(nothing), "");
  EXPECT_TRUE(nothing.f64("mass").empty());
  EXPECT_EQ(nothing.u32("force_parameter_begin").size(), 1U);
}

TEST(AbusedRequests, WildIndicesAreBeyondAllRows) {
  const Question question = force_question();
  for (const AbusedRequest& one : with_wild_indices(question)) {
    std::size_t changed = 0;
    for (const char* column : {"application", "force_parameter_begin", "body_shape", "shape_parameter_begin"}) {
      const auto& indices = one.request.u32(column);
      if (indices == question.request.u32(column)) continue;
      ++changed;
      for (const std::uint32_t index : indices) EXPECT_GT(index, 8U) << one.what;
    }
    EXPECT_EQ(changed, 1U) << one.what;
  }
}

TEST(LargeQuestion, RepeatsBodiesAndSharesForces) {
  const Question large = repeated(force_question(), 3);
  EXPECT_EQ(problem_of(large.request), "");
  EXPECT_EQ(large.request.f64("mass"), (std::vector<double>{1, 2, 1, 2, 1, 2}));
  EXPECT_EQ(large.request.u32("application"), (std::vector<std::uint32_t>{0, 0, 0, 1, 0, 2, 0, 3, 0, 4, 0, 5}));
  EXPECT_EQ(large.request.u32("force_parameter_begin"), (std::vector<std::uint32_t>{0, 2}));
}

TEST(LargeQuestion, RepeatsWhereRowsBegin) {
  const stage::Method bind = stage::Method::kConstraintBind;
  MessageColumns request = conformance::empty_request(bind);
  request.u64("constraint_type") = {1, 2};
  request.u32("constraint_body") = {GRAVITAS_NONE, 0, 0, 1};
  request.u32("constraint_kept") = {0, 1};
  request.u32("parameter_begin") = {0, 3, 5};
  request.f64("parameter") = {1, 2, 3, 4, 5};
  request.f64("position").resize(6);
  request.f64("orientation") = {1, 0, 0, 0, 1, 0, 0, 0};
  const Question large = repeated({"two joints", bind, request, {}}, 2);
  EXPECT_EQ(check_rows(stage::method_info(bind), large.request.counts(), {}), "");
  EXPECT_EQ(large.request.u32("constraint_body"),
            (std::vector<std::uint32_t>{GRAVITAS_NONE, 0, 0, 1, GRAVITAS_NONE, 2, 2, 3}));
  EXPECT_EQ(large.request.u32("parameter_begin"), (std::vector<std::uint32_t>{0, 3, 5, 8, 10}));
}

}  // namespace
}  // namespace gravitas::check
