#include "plugin_sdk/solver/profile_ldlt.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>

#include "plugin_sdk/plugin.h"

namespace gravitas {
namespace {

constexpr double kDependent = 1e-12;
constexpr double kRounding = 8.0 * std::numeric_limits<double>::epsilon();
constexpr double kDoubtful = 1e-4;  // of a diagonal: pivots that may be rounding

constexpr std::size_t kShort = 8;  // rows of joints in a chain: loops that are not worth being unrolled

double dot(const double* a, const double* b, std::size_t count) {
  if (count < kShort) {
    double sum = 0.0;
#pragma clang loop unroll(disable)
    for (std::size_t i = 0; i < count; ++i) sum += a[i] * b[i];
    return sum;
  }
  const auto size = static_cast<Eigen::Index>(count);
  return Eigen::Map<const Eigen::VectorXd>(a, size).dot(Eigen::Map<const Eigen::VectorXd>(b, size));
}

// b -= share a
void subtract(double share, const double* a, double* b, std::size_t count) {
  if (count < kShort) {
#pragma clang loop unroll(disable) vectorize(disable)
    for (std::size_t i = 0; i < count; ++i) b[i] -= a[i] * share;
    return;
  }
  const auto size = static_cast<Eigen::Index>(count);
  Eigen::Map<Eigen::VectorXd>(b, size) -= share * Eigen::Map<const Eigen::VectorXd>(a, size);
}

}  // namespace

void ProfileLdlt::start(const std::vector<std::size_t>& first) {
  first_ = first;
  begin_.assign(first.size() + 1, 0);
  for (std::size_t i = 0; i < first.size(); ++i) begin_[i + 1] = begin_[i] + (i - first[i] + 1);
  constexpr std::size_t kMostEntries = std::size_t{2} << 27;
  if (begin_.back() > kMostEntries)
    throw Refusal(std::to_string(first.size()) + " rows of joints depend on each other so that their factors take " +
                  std::to_string((begin_.back() * sizeof(double)) >> 30) + " GB; at most 2 GB are taken");
  values_.assign(begin_.back(), 0.0);
  pivot_.assign(first.size(), 0.0);
  dropped_.clear();
  null_.clear(), part_.clear();
}

void ProfileLdlt::factorise(double least) {
  least_pivot_ = 1.0, weakest_ = 0;
  scaled_.resize(size());
  for (std::size_t i = 0; i < size(); ++i) {
    double* row = &values_[begin_[i]];
    const std::size_t from = first_[i];
    const double diagonal = row[i - from];
    double pivot = diagonal;
    for (std::size_t j = from; j < i; ++j) {
      double& entry = row[j - from];
      if (!(pivot_[j] > 0.0)) {
        entry = scaled_[j] = 0.0;
        continue;
      }
      const std::size_t both = std::max(from, first_[j]);
      const double scaled = entry - dot(&scaled_[both], &values_[begin_[j] + both - first_[j]], j - both);
      scaled_[j] = scaled;
      entry = scaled / pivot_[j];
      pivot -= scaled * entry;
    }
    if (pivot > std::max(least, kDependent) * diagonal && (pivot > kDoubtful * diagonal || !is_rounding(i, pivot))) {
      pivot_[i] = pivot;
      if (pivot < least_pivot_ * diagonal) least_pivot_ = pivot / diagonal, weakest_ = i;
    } else {
      dropped_.push_back(i);
    }
  }
}

std::vector<double> ProfileLdlt::difference(std::size_t row) const {
  std::vector<double> z(size(), 0.0);
  for (std::size_t j = first_[row]; j < row; ++j)
    if (pivot_[j] > 0.0) z[j] = -values_[begin_[row] + j - first_[row]];
  solve_transposed(&z);
  z[row] = 1.0;
  return z;
}

// z is found from its row down, and no further than where the rest, however much it grows, adds too little.
bool ProfileLdlt::is_rounding(std::size_t row, double pivot) {
  constexpr double kGrowth = 1e3;        // of squares, times the least pivot
  constexpr std::size_t kRowsOfOne = 6;  // joint: what is to come is looked at now and then
  const double most = pivot / kRounding;
  const auto diagonal = [&](std::size_t k) { return values_[begin_[k + 1] - 1]; };
  combination_.assign(row, 0.0);
  std::size_t lowest = first_[row];
  for (std::size_t j = first_[row]; j < row; ++j)
    if (pivot_[j] > 0.0) combination_[j] = -values_[begin_[row] + j - first_[row]];
  double sum = diagonal(row);
  for (std::size_t k = row; k-- > lowest && sum < most;) {
    const double known = combination_[k];
    if (known == 0.0) continue;
    sum += known * known * diagonal(k);
    lowest = std::min(lowest, first_[k]);
    for (std::size_t j = first_[k]; j < k; ++j) combination_[j] -= values_[begin_[k] + j - first_[k]] * known;
    if (k % kRowsOfOne != 0) continue;
    double rest = 0.0;
    for (std::size_t j = lowest; j < k; ++j) rest += combination_[j] * combination_[j] * diagonal(j);
    if (sum + kGrowth / least_pivot_ * rest < most) return false;
  }
  return sum >= most;
}

void ProfileLdlt::solve_transposed(std::vector<double>* x) const {
  for (std::size_t i = size(); i-- > 0;) {
    if (!(pivot_[i] > 0.0)) continue;
    const double known = (*x)[i];
    if (known == 0.0) continue;
    subtract(known, &values_[begin_[i]], &(*x)[first_[i]], i - first_[i]);
  }
}

// Columns of dropped rows are 0, and so are their unknowns.
void ProfileLdlt::solve(std::vector<double>* b) const {
  double* x = b->data();
  for (std::size_t i = 0; i < size(); ++i) {
    const bool is_kept = pivot_[i] > 0.0;
    x[i] = is_kept ? x[i] - dot(&values_[begin_[i]], x + first_[i], i - first_[i]) : 0.0;
  }
  for (std::size_t i = 0; i < size(); ++i)
    if (pivot_[i] > 0.0) x[i] /= pivot_[i];
  solve_transposed(b);
  for (const std::size_t row : dropped_) x[row] = 0.0;
}

// Combinations of rows of one joint end where they begin: what is zero to rounding is left out of all sums.
void ProfileLdlt::find_null_space() const {
  constexpr double kNothing = 1e-15;
  for (const std::size_t row : dropped_) {
    NullVector z{0, difference(row)};  // A z = 0
    z.number.resize(row + 1);
    double largest = 0.0;
    for (const double number : z.number) largest = std::max(largest, std::fabs(number));
    for (double& number : z.number)
      if (std::fabs(number) < kNothing * largest) number = 0.0;
    while (z.number[z.first] == 0.0) ++z.first;
    for (int repeat = 0; repeat < 2; ++repeat)
      for (const NullVector& other : null_)
        if (other.number.size() > z.first) add(-product(other, z), other, &z);
    const double length = std::sqrt(product(z, z));
    for (double& number : z.number) number /= length;
    null_.push_back(std::move(z));
  }
}

// Over what both have.
double ProfileLdlt::product(const NullVector& a, const NullVector& b) {
  const std::size_t from = std::max(a.first, b.first), to = std::min(a.number.size(), b.number.size());
  return from < to ? dot(&a.number[from], &b.number[from], to - from) : 0.0;
}

void ProfileLdlt::add(double share, const NullVector& a, NullVector* b) {
  if (share == 0.0) return;
  for (std::size_t i = a.first; i < a.number.size(); ++i) b->number[i] += share * a.number[i];
  b->first = std::min(a.first, b->first);
}

// What is left of a dropped row's number by substitution is z^T b of its combination z. Rounding of a side is told by its
// largest number among rows that are connected, by way of others, with this one.
bool ProfileLdlt::is_consistent(const std::vector<double>& b, double enough) const {
  constexpr double kAgrees = 64.0 * std::numeric_limits<double>::epsilon();
  std::vector<double> y = b, largest;
  double most = 0.0;
  for (const double number : b) most = std::max(most, std::fabs(number));
  for (std::size_t i = 0; i < size(); ++i) {
    const double* row = &values_[begin_[i]];
    const double* before = &y[first_[i]];
    const std::size_t count = i - first_[i];
    if (pivot_[i] > 0.0) {
      y[i] -= dot(row, before, count);
      continue;
    }
    double terms = std::fabs(y[i]);
    for (std::size_t j = 0; j < count; ++j) {
      const double term = row[j] * before[j];
      y[i] -= term;
      terms += std::fabs(term);
    }
    const double left = std::fabs(y[i]);
    if (left <= std::max(enough, kAgrees * terms)) continue;
    if (!(left <= kAgrees * std::max(terms, most))) return false;
    if (largest.empty()) largest = largest_of_parts(b);
    if (!(left <= kAgrees * std::max(terms, largest[i]))) return false;
  }
  return true;
}

// By row, the largest number of a side among rows that are connected with it.
std::vector<double> ProfileLdlt::largest_of_parts(const std::vector<double>& b) const {
  if (part_.empty()) find_parts();
  std::vector<double> largest(size(), 0.0);
  for (std::size_t i = 0; i < size(); ++i) {
    double& number = largest[part_[i]];
    number = std::max(number, std::fabs(b[i]));
  }
  for (std::size_t i = 0; i < size(); ++i) largest[i] = largest[part_[i]];
  return largest;
}

// Each row's part goes by the name of its last row.
void ProfileLdlt::find_parts() const {
  part_.resize(size());
  const auto last_of = [&](std::size_t row) {
    while (part_[row] != row) row = part_[row] = part_[part_[row]];
    return row;
  };
  for (std::size_t i = 0; i < size(); ++i) {
    part_[i] = i;
    for (std::size_t j = first_[i]; j < i; ++j)
      if (values_[begin_[i] + j - first_[i]] != 0.0) part_[last_of(j)] = i;
  }
  for (std::size_t i = 0; i < size(); ++i) part_[i] = last_of(i);
}

double ProfileLdlt::make_consistent(std::vector<double>* b) const {
  return dropped_.empty() || is_consistent(*b) ? 0.0 : project(b);
}

// Takes away what lies in the null space; returns its length.
double ProfileLdlt::project(std::vector<double>* b) const {
  if (null_.empty()) find_null_space();
  Eigen::VectorXd shares(static_cast<Eigen::Index>(null_.size()));
  for (Eigen::Index k = 0; k < shares.size(); ++k) {
    const NullVector& z = null_[static_cast<std::size_t>(k)];
    const double share = shares[k] = dot(&z.number[z.first], &(*b)[z.first], z.number.size() - z.first);
    for (std::size_t i = z.first; i < z.number.size(); ++i) (*b)[i] -= share * z.number[i];
  }
  return shares.stableNorm();
}

}  // namespace gravitas
