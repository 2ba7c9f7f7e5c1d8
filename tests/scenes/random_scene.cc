#include "tests/scenes/random_scene.h"

#include <fmt/format.h>

#include <cmath>
#include <random>

#include "tests/scenes/scene_run.h"

namespace gravitas::harness {
namespace {

// std::uniform_real_distribution may differ between libraries; the engine does not.
class Random {
 public:
  explicit Random(std::uint64_t seed) : engine_(seed) {}
  double between(double low, double high) {
    return low + (high - low) * static_cast<double>(engine_() >> 11) * 0x1p-53;
  }
  Vector3 in_cube(double half) {
    const double x = between(-half, half), y = between(-half, half), z = between(-half, half);
    return {x, y, z};
  }
  Quaternion attitude() {
    for (;;) {
      const Vector3 v = in_cube(1.0);
      const double w = between(-1.0, 1.0), square = v.squaredNorm() + w * w;
      if (square > 0.01 && square < 1.0) return Quaternion(w, v.x(), v.y(), v.z()).normalized();
    }
  }
  std::uint32_t below(std::uint32_t limit) { return static_cast<std::uint32_t>(between(0.0, limit)); }

 private:
  std::mt19937_64 engine_;
};

void choose_shape(Random* random, Shapes shapes, RandomBody* body) {
  const std::uint32_t kind = shapes == Shapes::kSpheres ? 0 : random->below(3);
  const double size = random->between(0.3, 0.6);
  if (kind == 0) {
    body->geometry = "Sphere";
    body->properties = "Radius = " + literal(size);
    return;
  }
  const bool is_isotropic = shapes == Shapes::kIsotropic;
  if (kind == 1) {
    body->geometry = "Box";
    const Vector3 half =
        is_isotropic ? Vector3::Constant(size) : Vector3{size, random->between(0.1, 0.6), random->between(0.1, 0.6)};
    body->properties = "HalfExtents = " + literal(half);
    return;
  }
  body->geometry = "Cylinder";
  const double height = is_isotropic ? std::sqrt(3.0) * size : random->between(0.2, 1.4);
  body->properties = "Radius = " + literal(size) + " Height = " + literal(height);
}

}  // namespace

std::vector<RandomBody> random_bodies(std::uint64_t seed, Shapes shapes) {
  Random random(seed);
  std::vector<RandomBody> bodies;
  for (int corner = 0; corner < 8; ++corner) {
    RandomBody body;
    body.id = fmt::format("Body{}", corner);
    choose_shape(&random, shapes, &body);
    body.density = random.between(200.0, 5000.0);
    body.restitution = random.below(4) == 0 ? random.below(2) : random.between(0.0, 1.0);
    body.friction = random.below(4) == 0 ? 0.0 : random.between(0.0, 1.2);
    // corners of a cube of 3 m, so that no two bodies, of at most 1.1 m about their centres, overlap
    const Vector3 place((corner & 1) != 0 ? 1.5 : -1.5, (corner & 2) != 0 ? 1.5 : -1.5, (corner & 4) != 0 ? 1.5 : -1.5);
    body.pose = {place + random.in_cube(0.3), random.attitude()};
    body.twist = {-1.5 * place + random.in_cube(1.0), random.in_cube(3.0)};
    bodies.push_back(body);
  }
  return bodies;
}

RandomBody displaced(const RandomBody& body, const Pose& by) {
  RandomBody moved = body;
  moved.pose = compose(by, body.pose);
  moved.pose.orientation.normalize();
  moved.twist = {by.orientation * body.twist.linear, by.orientation * body.twist.angular};
  return moved;
}

std::string scene_text(const std::vector<RandomBody>& bodies, double time_step, double duration) {
  std::string geometries, materials, all;
  for (const RandomBody& body : bodies) {
    geometries += fmt::format("Geometry {{ Type = \"{}\" Id = \"{}\" CustomProperties {{ {} }} }}\n", body.geometry,
                              body.id, body.properties);
    materials += fmt::format("Material {{ Id = \"{}\" RestitutionCoefficient = {} StaticFrictionCoefficient = {} }}\n",
                             body.id, literal(body.restitution), literal(body.friction));
    all += fmt::format(
        "Body {{ Id = \"{0}\" GeometryId = \"{0}\" Material = \"{0}\" MassDensity = {1} KineticProperties {{ Position "
        "= {2} "
        "Orientation = {3} LinearVelocity = {4} AngularVelocity = {5} }} }}\n",
        body.id, literal(body.density), literal(body.pose.position), literal(body.pose.orientation),
        literal(body.twist.linear), literal(body.twist.angular));
  }
  return fmt::format(
      "Geometries {{\n{}}}\nMaterials {{\n{}}}\nSimulator {{ CustomProperties {{ TimeStep = {} Duration = {} }} }}\n"
      "Environment {{ Space {{ Bodies {{\n{}}} }} }}\n",
      geometries, materials, literal(time_step), literal(duration), all);
}

}  // namespace gravitas::harness
