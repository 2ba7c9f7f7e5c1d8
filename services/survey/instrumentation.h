// Debug geometry of a committed state (§ 3.9), sorted by kind, so that a viewer can switch each kind on and off. What a
// plugin knows (contacts, anchors, forces, edges of shapes, nodes of trees) it is asked for; the rest is looked up.
//
// Whatever is asked for, the run is not touched (surveyor.h). A kind that cannot be had is absent, with the reason in
// Frame.missing; kinds that nobody asks for cost nothing.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "gravitas/instrumentation/v1/instrumentation.pb.h"
#include "services/survey/surveyor.h"

namespace gravitas::survey {

using instrumentation::v1::Frame;
using instrumentation::v1::Kind;

// "contact", "joint", "force", "bounds", "trajectory", "space", "shape", "tree", "reaction".
std::string kind_name(Kind kind);
// All, in the order of the schema.
std::vector<Kind> all_kinds();
// Throws std::invalid_argument with what is allowed.
Kind find_kind(const std::string& name);

class Instrumentation {
 public:
  // Half-spaces are shown around the origin of their frame as far as the scene reaches when first they are asked for.
  explicit Instrumentation(Surveyor* surveyor);

  Frame frame(const kernel::Environment& environment, const std::vector<Kind>& kinds);
  // Trajectories go on from those of one before, of the same run.
  void go_on_from(Instrumentation&& before) { last_origins_ = std::move(before.last_origins_); }

 private:
  void add_contacts(const kernel::Environment& environment, bool shows_contacts, bool shows_reactions, Frame* frame);
  void add_joints(const kernel::Environment& environment, Frame* frame);
  void add_forces(const kernel::Environment& environment, Frame* frame);
  void add_bounds(const kernel::Environment& environment, Frame* frame) const;
  void add_trajectories(const kernel::Environment& environment, Frame* frame);
  void add_space(const kernel::Environment& environment, Frame* frame);
  void add_shapes(const kernel::Environment& environment, Frame* frame);
  void add_trees(const kernel::Environment& environment, Frame* frame);
  const MessageColumns& shape_geometry(const kernel::Environment& environment, std::uint32_t kinds);
  const std::string& body_id(std::uint32_t body) const;
  double extent(const kernel::Environment& environment);

  Surveyor& surveyor_;
  // of the plugin that was asked
  std::string geometry_plugin_;
  std::map<std::uint32_t, MessageColumns> shape_geometry_;  // by kinds
  std::optional<double> extent_;
  std::map<std::string, Vector3> last_origins_;  // of the geometries by body, in the last frame with trajectories
};

}  // namespace gravitas::survey
