// Every fuzz target over its committed corpus, over each entry cut short, and over entries with single bytes changed:
// what the fuzzers found once is found by the test suite for ever.
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>
#include <vector>

#include "tests/fuzz/fuzz_target.h"
#include "tests/paths.h"

namespace gravitas {
namespace {

using Bytes = std::vector<std::byte>;

std::vector<std::pair<std::string, Bytes>> corpus(const std::string& target) {
  std::vector<std::pair<std::string, Bytes>> entries;
  for (const auto& file : std::filesystem::directory_iterator(in_source("/tests/fuzz/corpus/") + target)) {
    std::ifstream in(file.path(), std::ios::binary);
    const std::string text{std::istreambuf_iterator<char>(in), {}};
    const auto bytes = std::as_bytes(std::span(text));
    entries.emplace_back(file.path().filename(), Bytes(bytes.begin(), bytes.end()));
  }
  return entries;
}

class Corpus : public ::testing::TestWithParam<fuzz::NamedTarget> {};

// About this many variants of an entry, evenly over its length.
constexpr std::size_t kVariants = 40;

TEST_P(Corpus, IsTaken) {
  const auto entries = corpus(GetParam().name);
  ASSERT_FALSE(entries.empty());
  for (const auto& [name, bytes] : entries) {
    SCOPED_TRACE(name);
    GetParam().run(bytes);
    const std::size_t stride = std::max<std::size_t>(1, bytes.size() / kVariants);
    for (std::size_t i = 0; i < bytes.size(); i += stride) {
      GetParam().run(std::span(bytes).first(i));
      Bytes changed = bytes;
      for (const int bit : {0, 3, 7}) {
        changed[i] = bytes[i] ^ std::byte(1 << bit);
        GetParam().run(changed);
      }
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Target, Corpus, ::testing::ValuesIn(fuzz::kTargets),
                         [](const auto& one) { return std::string(one.param.name); });

}  // namespace
}  // namespace gravitas
