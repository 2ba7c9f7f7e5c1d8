#include "services/recorder/trajectory.h"

#include <fmt/format.h>

#include <iterator>
#include <utility>

#include "services/recorder/csv.h"

namespace gravitas {

TrajectoryWriter::TrajectoryWriter(const std::string& path, const kernel::EnvironmentDescription& description,
                                   double interval)
    : file_("trajectory", path), sampling_(interval) {
  follow(description);
}

void TrajectoryWriter::begin() {
  if (!std::exchange(has_begun_, true)) file_.write("time,body,px,py,pz,qw,qx,qy,qz,vx,vy,vz,wx,wy,wz\n");
}

void TrajectoryWriter::follow(const kernel::EnvironmentDescription& description) {
  rows_.clear();
  for (std::uint32_t i = 0; i < description.bodies.size(); ++i) {
    const kernel::BodyDescription& body = description.bodies[i];
    if ((body.flags & (kMovable | kKinematic)) != 0) rows_.push_back({i, csv_quoted(body.id), body.geometry});
  }
}

void TrajectoryWriter::offer(const kernel::Environment& environment, bool last) {
  if (sampling_.is_due(environment, last)) write_sample(environment);
}

void TrajectoryWriter::write_sample(const kernel::Environment& environment) {
  begin();
  const kernel::StateView state = environment.state();
  fmt::memory_buffer text;
  for (const Row& row : rows_) {
    const Pose body{vector_at(state.position, row.body), quaternion_at(state.orientation, row.body)};
    const Pose pose = compose(body, row.geometry);
    const Vector3 v = vector_at(state.linear_velocity, row.body), w = vector_at(state.angular_velocity, row.body);
    fmt::format_to(std::back_inserter(text),
                   "{:.17g},{},{:.17g},{:.17g},{:.17g},{:.17g},{:.17g},{:.17g},{:.17g},{:.17g},{:.17g},{:.17g},{:.17g},"
                   "{:.17g},{:.17g}\n",
                   environment.time(), row.id, pose.position.x(), pose.position.y(), pose.position.z(),
                   pose.orientation.w(), pose.orientation.x(), pose.orientation.y(), pose.orientation.z(), v.x(), v.y(),
                   v.z(), w.x(), w.y(), w.z());
  }
  file_.write({text.data(), text.size()});
}

}  // namespace gravitas
