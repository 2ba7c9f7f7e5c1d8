// Durations of stages and steps, kept in fixed memory: a histogram with sixteen buckets per octave, so that
// medians and percentiles are known to about four per cent however long the run.
#pragma once

#include <array>
#include <bit>
#include <cstdint>

namespace gravitas {

class DurationHistogram {
 public:
  void add(std::uint64_t ns) {
    ++buckets_[bucket(ns)];
    ++count_;
    sum_ns_ += ns;
    if (ns > max_ns_) max_ns_ = ns;
  }

  std::uint64_t count() const { return count_; }
  double mean_us() const {
    return count_ == 0 ? 0.0 : static_cast<double>(sum_ns_) / static_cast<double>(count_) * 1e-3;
  }
  double max_us() const { return static_cast<double>(max_ns_) * 1e-3; }

  // Duration below which the share `quantile` (0 … 1) of all lie, in microseconds.
  double quantile_us(double quantile) const {
    const double wanted = quantile * static_cast<double>(count_);
    double seen = 0.0;
    for (std::uint32_t i = 0; i < kBuckets; ++i) {
      seen += buckets_[i];
      if (seen >= wanted && seen > 0.0) return std::min(middle_ns(i) * 1e-3, max_us());
    }
    return 0.0;
  }

 private:
  static constexpr std::uint32_t kPerOctave = 16;
  static constexpr std::uint32_t kBuckets = 61 * kPerOctave;

  // 0 … 15 ns have a bucket each; above, four bits below the leading one choose it.
  static std::uint32_t bucket(std::uint64_t ns) {
    if (ns < kPerOctave) return static_cast<std::uint32_t>(ns);
    const auto octave = static_cast<std::uint32_t>(std::bit_width(ns)) - 5;
    return (octave + 1) * kPerOctave + static_cast<std::uint32_t>((ns >> octave) - kPerOctave);
  }
  static double middle_ns(std::uint32_t bucket) {
    if (bucket < kPerOctave) return bucket;
    const std::uint32_t octave = bucket / kPerOctave - 1;
    return (static_cast<double>(bucket % kPerOctave + kPerOctave) + 0.5) * static_cast<double>(1ULL << octave);
  }

  std::array<std::uint32_t, kBuckets> buckets_{};
  std::uint64_t count_ = 0, sum_ns_ = 0, max_ns_ = 0;
};

}  // namespace gravitas
