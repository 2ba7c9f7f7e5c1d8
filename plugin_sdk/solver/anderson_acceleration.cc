#include "plugin_sdk/solver/anderson_acceleration.h"

#include <Eigen/QR>

namespace gravitas {

Eigen::VectorXd AndersonAcceleration::next(const Eigen::VectorXd& x, const Eigen::VectorXd& image) {
  images_.push_back(image), changes_.push_back(image - x);
  if (images_.size() > kMemory) images_.erase(images_.begin()), changes_.erase(changes_.begin());
  const auto steps = static_cast<Eigen::Index>(images_.size()) - 1;
  if (steps == 0) return image;
  Eigen::MatrixXd of_images(x.size(), steps), of_changes(x.size(), steps);
  for (Eigen::Index i = 0; i < steps; ++i) {
    const auto k = static_cast<std::size_t>(i);
    of_images.col(i) = images_[k + 1] - images_[k];
    of_changes.col(i) = changes_[k + 1] - changes_[k];
  }
  const Eigen::VectorXd mixed = image - of_images * of_changes.colPivHouseholderQr().solve(changes_.back());
  return mixed.allFinite() ? mixed : image;
}

}  // namespace gravitas
