#include "plugin_sdk/extrapolation.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace gravitas {

constexpr std::size_t kLeast = 2;  // of results beside the last: two may agree by chance
constexpr double kUnknownError = std::numeric_limits<double>::infinity();

void Extrapolation::begin() {
  row_.clear();
  scale_.clear();
  pieces_ = 0;
}

void Extrapolation::put(double number, double scale) {
  row_.push_back(number);
  scale_.push_back(scale);
}

double Extrapolation::add() {
  const auto pieces = static_cast<double>(++pieces_);
  if (table_.size() < pieces_) table_.emplace_back(), error_.emplace_back();
  table_[pieces_ - 1].resize(row_.size());
  std::fill_n(error_.begin(), pieces_, 0.0);
  error_[0] = kUnknownError;
  for (std::size_t i = 0; i < row_.size(); ++i) {
    double next = row_[i];
    for (std::size_t k = 1; k < pieces_; ++k) {
      const double before = table_[k - 1][i], ratio = pieces / (pieces - static_cast<double>(k));
      const double change = (next - before) / (ratio - 1.0);
      table_[k - 1][i] = next;
      next += change;
      const double error = std::fabs(k + 1 < pieces_ ? next - before : change) / scale_[i];
      error_[k] = std::isfinite(next) ? std::max(error_[k], error) : kUnknownError;
    }
    table_[pieces_ - 1][i] = next;
  }
  row_.clear();
  scale_.clear();
  // the last of equals, which leaves out least
  best_ = pieces_ - 1;
  for (std::size_t k = best_; k-- > kLeast;)
    if (error_[k] < error_[best_]) best_ = k;
  return error_[best_];
}

std::span<const double> Extrapolation::weights() {
  weights_.assign(pieces_, 0.0);
  for (std::size_t n = pieces_ - best_; n <= pieces_; ++n) {
    double weight = 1.0;
    for (std::size_t m = pieces_ - best_; m <= pieces_; ++m)
      if (m != n) weight *= static_cast<double>(n) / (static_cast<double>(n) - static_cast<double>(m));
    weights_[n - 1] = weight;
  }
  return weights_;
}

double Extrapolation::least_size() const {
  double least = kUnknownError;
  for (std::size_t k = std::min<std::size_t>(kLeast, pieces_ - 1); k < pieces_; ++k) {
    double size = 0.0;
    for (const double number : table_[k]) size = std::max(size, std::fabs(number));
    least = std::min(least, size);
  }
  return least;
}

}  // namespace gravitas
