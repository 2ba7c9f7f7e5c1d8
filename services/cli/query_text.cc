#include "services/cli/query_text.h"

#include <fmt/format.h>
#include <google/protobuf/util/json_util.h>

#include <cstdlib>
#include <stdexcept>
#include <system_error>

#include "plugin_sdk/counted.h"
#include "services/recorder/durable_file.h"
#include "services/run/session.h"

namespace gravitas::cli {
namespace {

std::string batch_text(const std::string& word) {
  if (!word.starts_with('@')) return word;
  try {
    const std::vector<std::byte> bytes = read_whole_file(word.substr(1));
    return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
  } catch (const std::runtime_error& problem) {
    throw BadInput(fmt::format("query {}: {}", word, problem.what()));
  }
}

double number_of(const std::string& option, const std::string& whole, const std::string& word) {
  char* end = nullptr;
  const double number = std::strtod(word.c_str(), &end);
  if (word.empty() || *end != '\0') throw BadInput(fmt::format("{} {}: '{}' is no number", option, whole, word));
  return number;
}

std::vector<double> numbers_of(const std::string& option, const std::string& text) {
  std::vector<double> numbers;
  for (std::size_t begin = 0;;) {
    const std::size_t comma = text.find(',', begin);
    numbers.push_back(number_of(option, text, text.substr(begin, comma - begin)));
    if (comma == std::string::npos) return numbers;
    begin = comma + 1;
  }
}

using Numbers = google::protobuf::RepeatedField<double>;

std::string shown(const Numbers& v) {
  return v.size() == 3 ? fmt::format("({:.9g}, {:.9g}, {:.9g})", v[0], v[1], v[2]) : "()";
}

// "ray 2: no hit", or a line for each of its hits.
template <typename AnswerList, typename Show>
void append(const char* name, const AnswerList& answers, const char* none, std::string* text, const Show& show) {
  for (int i = 0; i < answers.size(); ++i) {
    if (answers[i].hits().empty()) *text += fmt::format("{} {}: {}\n", name, i + 1, none);
    for (const auto& hit : answers[i].hits()) *text += fmt::format("{} {}: {}\n", name, i + 1, show(hit));
  }
}

}  // namespace

query::v1::Batch parse_query(const QueryText& text) {
  query::v1::Batch batch;
  if (!text.batch.empty()) {
    const auto status = google::protobuf::util::JsonStringToMessage(batch_text(text.batch), &batch);
    if (!status.ok())
      throw BadInput(
          fmt::format("query {}: {}; allowed: a batch as schemas/gravitas/query/v1/query.proto has it, such as "
                      "{{\"rays\": [{{\"origin\": [0, 5, 0], \"direction\": [0, -1, 0]}}]}}",
                      text.batch, std::string(status.message())));
  }
  for (const std::string& one : text.rays) {
    const std::vector<double> numbers = numbers_of("--ray", one);
    if (numbers.size() != 6 && numbers.size() != 7)
      throw BadInput(
          fmt::format("--ray {}: {}; allowed: X,Y,Z,DX,DY,DZ[,LENGTH]", one, counted(numbers.size(), "number")));
    query::v1::Ray* ray = batch.add_rays();
    for (std::size_t i = 0; i < 6; ++i) (i < 3 ? ray->mutable_origin() : ray->mutable_direction())->Add(numbers[i]);
    if (numbers.size() == 7) ray->set_length(numbers[6]);
    if (text.all) ray->set_hits(query::v1::HITS_ALL);
  }
  for (const std::string& body : text.overlaps) batch.add_overlaps()->mutable_shape()->set_body(body);
  for (const std::string& one : text.closest) {
    const std::size_t equals = one.rfind('=');
    if (equals == std::string::npos || equals == 0)
      throw BadInput(fmt::format("--closest {}: allowed: BODY=DISTANCE, such as Ball01=0.5", one));
    query::v1::ClosestPoints* closest = batch.add_closest();
    closest->mutable_shape()->set_body(one.substr(0, equals));
    closest->set_distance(number_of("--closest", one, one.substr(equals + 1)));
  }
  if (batch.ByteSizeLong() == 0) throw BadInput("query: nothing is asked; allowed: BATCH, --ray, --overlap, --closest");
  return batch;
}

std::string answers_text(const query::v1::Answers& answers) {
  std::string text = fmt::format("t = {:.6g} s, step {}\n", answers.time(), answers.step());
  append("ray", answers.rays(), "meets nothing", &text, [](const query::v1::RayHit& hit) {
    return fmt::format("{} at {:.9g} m, point {}, normal {}", hit.body(), hit.distance(), shown(hit.point()),
                       shown(hit.normal()));
  });
  append("cast", answers.casts(), "meets nothing", &text, [](const query::v1::CastHit& hit) {
    return fmt::format("{} at fraction {:.9g}, point {}, normal {}", hit.body(), hit.fraction(), shown(hit.point()),
                       shown(hit.normal()));
  });
  append("overlap", answers.overlaps(), "overlaps nothing", &text, [](const query::v1::OverlapHit& hit) {
    return fmt::format("{} by {:.9g} m, point {}, normal {}", hit.body(), hit.depth(), shown(hit.point()),
                       shown(hit.normal()));
  });
  append("closest", answers.closest(), "nothing is that near", &text, [](const query::v1::ClosestHit& hit) {
    return fmt::format("{} at {:.9g} m, from {} to {}", hit.body(), hit.distance(), shown(hit.point_on_shape()),
                       shown(hit.point_on_body()));
  });
  return text;
}

}  // namespace gravitas::cli
