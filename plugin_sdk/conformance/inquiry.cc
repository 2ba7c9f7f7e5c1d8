#include "plugin_sdk/conformance/inquiry.h"

#include <cmath>
#include <utility>

#include "plugin_sdk/checks.h"
#include "plugin_sdk/counted.h"
#include "plugin_sdk/math/rotation.h"

namespace gravitas::conformance {
namespace {

std::string status_name(std::int32_t status) {
  switch (status) {
    case GRAVITAS_OK:
      return "OK";
    case GRAVITAS_NEEDS_CAPACITY:
      return "NEEDS_CAPACITY";
    case GRAVITAS_REFUSED:
      return "REFUSED";
    case GRAVITAS_FAILED:
      return "FAILED";
    case GRAVITAS_UNKNOWN_METHOD:
      return "UNKNOWN_METHOD";
    case GRAVITAS_CALLBACK_FAILED:
      return "CALLBACK_FAILED";
    default:
      return "status " + std::to_string(status);
  }
}

std::string outcome_of(const Answer& answer) {
  if (!answer.fault.empty()) return answer.fault;
  return status_name(answer.status) + (answer.text.empty() ? "" : " (" + answer.text + ")");
}

template <typename T>
std::string text_of(T number) {
  if constexpr (std::is_same_v<T, double>) return number_text(number);
  return std::to_string(number);
}

template <typename T>
std::string first_difference(std::span<const T> came, std::span<const T> right) {
  if (came.size() != right.size())
    return "has " + counted(came.size(), "number") + ", should have " + std::to_string(right.size());
  for (std::size_t i = 0; i < came.size(); ++i)
    if (!(came[i] == right[i]))
      return "number " + std::to_string(i) + " is " + text_of(came[i]) + ", should be " + text_of(right[i]) +
             " exactly";
  return {};
}

}  // namespace

Case make_case(std::string name, std::string claim, std::function<void(Subject&)> judge) {
  return {std::move(name), std::move(claim), [judge = std::move(judge)](Subject& subject) -> std::string {
            try {
              judge(subject);
              return {};
            } catch (const Finding& finding) {
              return finding.what();
            }
          }};
}

Case make_varied_case(std::string name, std::string claim, std::function<void(Subject&, bool varies)> judge) {
  return make_case(std::move(name), std::move(claim), [judge = std::move(judge)](Subject& subject) {
    try {
      judge(subject, true);
    } catch (const Refused&) {
      judge(subject, false);
    }
  });
}

MessageColumns empty_request(stage::Method method) { return MessageColumns(stage::method_info(method).request); }
MessageColumns empty_reply(stage::Method method) { return MessageColumns(stage::method_info(method).reply); }

void append(std::vector<double>* column, const Vector3& v) { column->insert(column->end(), {v.x(), v.y(), v.z()}); }
void append(std::vector<double>* column, const Quaternion& q) {
  column->insert(column->end(), {q.w(), q.x(), q.y(), q.z()});
}

std::string shown(const Vector3& v) {
  return "(" + number_text(v.x()) + ", " + number_text(v.y()) + ", " + number_text(v.z()) + ")";
}
std::string shown(const Quaternion& q) {
  return "(" + number_text(q.w()) + ", " + number_text(q.x()) + ", " + number_text(q.y()) + ", " + number_text(q.z()) +
         ")";
}

// ---- questions

Inquiry Inquiry::demanding_answers() const {
  Inquiry other = *this;
  other.may_be_refused_ = false;
  return other;
}

Answer Inquiry::ask(stage::Method method, const MessageColumns& request, const DerivativeFunction& derivative) {
  return subject_.ask(method, request, derivative);
}

void Inquiry::expect_finite(stage::Method method, const MessageColumns& reply) const {
  for (const stage::ColumnInfo& column : stage::method_info(method).reply) {
    if (column.type != stage::ElementType::kF64) continue;
    const std::vector<double>& numbers = reply.f64(column.name);
    const std::size_t i = first_not_finite(numbers);
    if (i != kNoRow)
      fail("answered " + number_text(numbers[i]) + " in " + column.name + ", row " +
           std::to_string(i / column.components) + "; every number of an answer must be finite");
  }
}

MessageColumns Inquiry::answer(stage::Method method, const MessageColumns& request,
                               const DerivativeFunction& derivative) {
  Answer answer = ask(method, request, derivative);
  if (is_refusal(answer) && !answer.text.empty() && may_be_refused_)
    throw Refused(asked_ + ": must be answered, came: " + outcome_of(answer));
  if (!answer.ok()) fail("must be answered, came: " + outcome_of(answer));
  expect_finite(method, answer.columns);
  return std::move(answer.columns);
}

MessageColumns Inquiry::answer_rows(stage::Method method, const MessageColumns& request, std::size_t rows,
                                    const std::function<MessageColumns(std::size_t)>& alone) {
  try {
    return answer(method, request);
  } catch (const Refused& refused) {
    for (std::size_t i = 0; i < rows; ++i) answer(method, alone(i));
    throw Finding(std::string(refused.what()) + "; each of its rows alone is answered");
  }
}

std::optional<MessageColumns> Inquiry::answer_or_refusal(stage::Method method, const MessageColumns& request,
                                                         const DerivativeFunction& derivative) {
  Answer answer = ask(method, request, derivative);
  if (answer.ok()) {
    expect_finite(method, answer.columns);
    return std::move(answer.columns);
  }
  if (!is_refusal(answer)) fail("must be refused, or answered with finite numbers; came: " + outcome_of(answer));
  expect(!answer.text.empty(), "was refused without a reason");
  return std::nullopt;
}

void Inquiry::demand_refusal(stage::Method method, const MessageColumns& request,
                             const DerivativeFunction& derivative) {
  const Answer answer = ask(method, request, derivative);
  if (!is_refusal(answer)) fail("must be refused (GRAVITAS_REFUSED and a reason); came: " + outcome_of(answer));
  expect(!answer.text.empty(), "was refused without a reason");
}

// ---- comparisons

void Inquiry::fail(const std::string& text) const { throw Finding(asked_ + ": " + text); }

void Inquiry::expect(bool holds, const std::string& otherwise) const {
  if (!holds) fail(otherwise);
}

void Inquiry::expect_near(const std::string& what, double came, double right, double tolerance) const {
  if (std::fabs(came - right) <= tolerance) return;
  fail(what + " is " + number_text(came) + ", should be " + number_text(right) + " (within " + number_text(tolerance) +
       ")");
}

void Inquiry::expect_near(const std::string& what, const Vector3& came, const Vector3& right, double tolerance) const {
  if ((came - right).norm() <= tolerance) return;
  fail(what + " is " + shown(came) + ", should be " + shown(right) + " (within " + number_text(tolerance) + ")");
}

void Inquiry::expect_near(const std::string& what, const Quaternion& came, const Quaternion& right,
                          double tolerance) const {
  const double apart = log_rotation(came * right.conjugate()).norm();
  if (apart <= tolerance) return;
  fail(what + " is " + shown(came) + ", should be " + shown(right) + ": they are " + number_text(apart) +
       " rad apart (within " + number_text(tolerance) + ")");
}

void Inquiry::expect_at_most(const std::string& what, double came, double most) const {
  if (came <= most) return;
  fail(what + " is " + number_text(came) + ", should be at most " + number_text(most));
}

void Inquiry::expect_equal(const std::string& what, std::span<const double> came, std::span<const double> right) const {
  const std::string difference = first_difference(came, right);
  expect(difference.empty(), what + " " + difference);
}

void Inquiry::expect_equal(const std::string& what, std::span<const std::uint32_t> came,
                           std::span<const std::uint32_t> right) const {
  const std::string difference = first_difference(came, right);
  expect(difference.empty(), what + " " + difference);
}

void Inquiry::expect_unit(const std::string& what, std::span<const double> column, std::size_t components) const {
  const std::size_t row = first_not_unit(column, components);
  if (row == kNoRow) return;
  double square = 0.0;
  for (std::size_t k = 0; k < components; ++k) square += column[components * row + k] * column[components * row + k];
  fail(what + " of row " + std::to_string(row) + " has norm " + number_text(std::sqrt(square)) + ", should have 1");
}

}  // namespace gravitas::conformance
