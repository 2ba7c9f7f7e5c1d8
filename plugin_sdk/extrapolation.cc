#include "plugin_sdk/extrapolation.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace gravitas {

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
  if (table_.size() < pieces_) table_.emplace_back();
  table_[pieces_ - 1].resize(row_.size());
  double error = pieces_ == 1 ? kUnknownError : 0.0;
  for (std::size_t i = 0; i < row_.size(); ++i) {
    double next = row_[i];
    for (std::size_t k = 1; k < pieces_; ++k) {
      const double before = table_[k - 1][i], ratio = pieces / (pieces - static_cast<double>(k));
      table_[k - 1][i] = next;
      next += (next - before) / (ratio - 1.0);
    }
    table_[pieces_ - 1][i] = next;
    if (pieces_ > 1) error = std::max(error, std::fabs(next - table_[pieces_ - 2][i]) / scale_[i]);
    if (!std::isfinite(next)) error = kUnknownError;
  }
  row_.clear();
  scale_.clear();
  return error;
}

}  // namespace gravitas
