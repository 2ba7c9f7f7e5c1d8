// Continuous collision queries in their published format (B. Wang, Z. Ferguson, T. Schneider, X. Jiang, M. Attene and D.
// Panozzo, "A large scale benchmark and an inclusion-based algorithm for continuous collision detection", 2021): eight
// rows a query, of three rational coordinates and whether there is a collision. Four corners at the start, then the same
// at the end: vertex and face, or edge and edge. Corners go straight.
//
// ccd_queries/ has our own. GRAVITAS_CCD_QUERIES names a file or folder of others, whose paths say `vertex-face` or
// `edge-edge`. A collision must never be missed; what is found beside them is counted.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <sstream>
#include <string>
#include <vector>

#include "plugin_sdk/geometry/time_of_impact.h"
#include "tests/paths.h"
#include "tests/plugin_sdk/geometry/random_shapes.h"
#include "tests/sanitized.h"

namespace gravitas {
namespace {

namespace fs = std::filesystem;

struct Query {
  std::array<Vector3, 4> start, end;
  bool collides = false;
};

// What is wrong with the row, or nothing. Numerators and denominators of doubles have up to hundreds of digits; they are
// rounded once each, and to nothing where they are a double's.
std::string read_row(const std::string& line, Vector3* point, bool* collides) {
  std::vector<double> numbers;
  std::istringstream cells(line);
  for (std::string cell; std::getline(cells, cell, ',');) {
    char* end = nullptr;
    numbers.push_back(std::strtod(cell.c_str(), &end));
    if (end == cell.c_str()) return "'" + cell + "' is no number";
  }
  if (numbers.size() != 7) return std::to_string(numbers.size()) + " columns, should be 7";
  for (int i = 0; i < 3; ++i)
    (*point)[i] = numbers[static_cast<std::size_t>(2 * i)] / numbers[static_cast<std::size_t>(2 * i + 1)];
  if (!point->allFinite()) return "a coordinate that is not finite";
  *collides = numbers[6] != 0.0;
  return {};
}

std::vector<Query> read_queries(std::istream& in, const std::string& name) {
  std::vector<Query> queries;
  std::string line;
  for (std::size_t row = 0; std::getline(in, line); ++row) {
    if (line.empty()) break;
    if (row % 8 == 0) queries.emplace_back();
    Query& query = queries.back();
    const std::string problem =
        read_row(line, row % 8 < 4 ? &query.start[row % 4] : &query.end[row % 4], &query.collides);
    if (!problem.empty()) {
      ADD_FAILURE() << name << ":" << row + 1 << ": " << problem;
      return {};
    }
  }
  return queries;
}

std::optional<Impact> answer(const Query& query, bool is_edges, double target = 1e-9) {
  MovingCorners a, b;
  a.count = is_edges ? 2 : 1;
  b.count = 4 - a.count;
  for (std::size_t i = 0; i < 4; ++i) {
    MovingCorners& side = i < a.count ? a : b;
    const std::size_t k = i < a.count ? i : i - a.count;
    side.start[k] = query.start[i], side.end[k] = query.end[i];
  }
  return first_impact(a, b, target);
}

struct Score {
  std::size_t queries = 0, collisions = 0, missed = 0, added = 0;
};

Score judge(const fs::path& file) {
  const bool is_edges = file.string().find("edge-edge") != std::string::npos;
  if (!is_edges && file.string().find("vertex-face") == std::string::npos) return {};
  std::ifstream in(file);
  Score score;
  for (const Query& query : read_queries(in, file.string())) {
    const bool found = answer(query, is_edges).has_value();
    ++score.queries;
    score.collisions += query.collides ? 1 : 0;
    if (query.collides && !found) {
      ++score.missed;
      ADD_FAILURE() << file << ", query " << score.queries - 1 << " (rows from " << 8 * score.queries - 7 << ") missed";
    }
    score.added += !query.collides && found ? 1 : 0;
  }
  return score;
}

TEST(CcdQueries, OurOwnAreAnsweredRightBothWays) {
  for (const char* name : {"vertex-face.csv", "edge-edge.csv"}) {
    const Score score = judge(in_source("/tests/plugin_sdk/geometry/ccd_queries/") + std::string(name));
    EXPECT_GE(score.queries, 16U);
    EXPECT_GT(score.collisions, 8U);
    EXPECT_EQ(score.added, 0U) << name;
  }
}

TEST(CcdQueries, NoneOfAGivenSetIsMissed) {
  const char* given = std::getenv("GRAVITAS_CCD_QUERIES");
  if (given == nullptr) GTEST_SKIP() << "GRAVITAS_CCD_QUERIES names no file or folder";
  std::vector<fs::path> files;
  if (fs::is_directory(given)) {
    for (const fs::directory_entry& entry : fs::recursive_directory_iterator(given))
      if (entry.path().extension() == ".csv") files.push_back(entry.path());
  } else {
    files.emplace_back(given);
  }
  Score all;
  for (const fs::path& file : files) {
    const Score score = judge(file);
    all.queries += score.queries, all.collisions += score.collisions;
    all.missed += score.missed, all.added += score.added;
  }
  EXPECT_GT(all.queries, 0U) << "no file with vertex-face or edge-edge in its path";
  std::cout << all.queries << " queries, " << all.collisions << " collisions, " << all.missed << " missed, "
            << all.added << " found beside them\n";
}

// Corners on a grid of 2^-10 m and times in quarters, so that the meeting is exact in doubles.
TEST(CcdQueries, WhatMeetsByConstructionIsFoundNoLater) {
  test::RandomShapes random(95);
  const auto on_grid = [&] {
    const Vector3 v = random.vector(-1024, 1024);
    return Vector3(Vector3(v.array().round()) / 1024.0);
  };
  int early = 0;
  double most = 0.0;
  for (int i = 0; i < harness::unless_sanitized(20000); ++i) {
    const bool is_edges = i % 2 == 1;
    const double time = 0.25 * (1 + i % 3);
    Query query;
    for (std::size_t k = 0; k < 4; ++k) query.start[k] = on_grid(), query.end[k] = on_grid();
    const auto at = [&](std::size_t k) { return Vector3(query.start[k] + time * (query.end[k] - query.start[k])); };
    // the first corner passes, at the time, where it must to meet: its start is moved there
    const double u = 0.25 * (i % 5), v = 0.25 * (i / 5 % 5);
    const Vector3 meeting = is_edges ? Vector3(at(2) + u * (at(3) - at(2)))
                                     : Vector3(at(1) + u * (at(2) - at(1)) + (1.0 - u) * v * (at(3) - at(1)));
    const Vector3 off = is_edges ? Vector3(meeting - (at(0) + v * (at(1) - at(0)))) : Vector3(meeting - at(0));
    query.start[0] += off, query.end[0] += off;
    if (is_edges) query.start[1] += off, query.end[1] += off;
    const std::optional<Impact> found = answer(query, is_edges);
    ASSERT_TRUE(found) << "query " << i;
    ASSERT_LE(found->fraction, time) << "query " << i;
    // the target, or what counts as the least: 1e-10 of the coordinates
    double reach = 0.0;
    for (std::size_t k = 0; k < 4; ++k)
      reach = std::max({reach, (query.start[k] - query.start[0]).norm(), (query.end[k] - query.start[0]).norm()});
    early += -found->depth > std::max(1e-9, 1e-10 * reach) * (1.0 + 1e-9) ? 1 : 0;
    most = std::max(most, -found->depth / reach);
  }
  // only what is so nearly flush that rounding hides the plane between (see the header)
  EXPECT_LE(early, 4);
  EXPECT_LE(most, 1e-7);
}

TEST(CcdQueries, WhatAPlaneKeepsApartIsNotFound) {
  test::RandomShapes random(96);
  for (int i = 0; i < harness::unless_sanitized(20000); ++i) {
    const bool is_edges = i % 2 == 1;
    const Vector3 n = random.direction();
    Query query;
    for (std::size_t k = 0; k < 4; ++k) {
      const double side = k < (is_edges ? 2U : 1U) ? 1.0 : -1.0;
      for (Vector3* point : {&query.start[k], &query.end[k]}) {
        *point = random.vector(-1, 1);
        *point += n * (side * random.uniform(1e-6, 1e-3) - n.dot(*point));
      }
    }
    ASSERT_FALSE(answer(query, is_edges)) << "query " << i;
  }
}

}  // namespace
}  // namespace gravitas
