// With `Smooth` a mechanism moves beside others that it does not touch as it does alone, bit for bit, however large or heavy
// they are and in whatever order they are listed, also where the rows of its joints depend on each other.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "tests/scenes/scene_run.h"

namespace gravitas {
namespace {

using harness::literal;
using harness::SceneRun;
using harness::set;

// A mechanism of a size and mass: all of one kind are similar in space, and move alike in time.
class Linkage {
 public:
  Linkage(std::string name, double size, double mass, const Vector3& place, const Vector3& gravity)
      : name_(std::move(name)), size_(size), mass_(mass), place_(place) {
    force_ = "Force { Type = \"Gravity\" Id = \"" + name_ +
             "\" CustomProperties { Acceleration = " + literal(Vector3(size * gravity)) + " } }\n";
  }

  void add_body(const std::string& id, double mass, const Vector3& moments, const Vector3& position,
                const Vector3& velocity, const Vector3& spin) {
    bodies_.push_back("Body { Id = \"" + name_ + id + "\" Mass = " + literal(mass_ * mass) +
                      " PrincipalMoments = " + literal(Vector3(mass_ * size_ * size_ * moments)) + " Forces = {\"" +
                      name_ + "\"} KineticProperties { Position = " + at(position) + " LinearVelocity = " +
                      literal(Vector3(size_ * velocity)) + " AngularVelocity = " + literal(spin) + " } }\n");
    ids_.push_back(name_ + id);
  }
  // `one` may be none: the world.
  void add_hinge(const std::string& one, const std::string& two, const Vector3& point, const Vector3& axis) {
    add_joint("Revolute", one, two, "BindAxisPoint1 = " + at(point) + " BindAxisPoint2 = " + at(Vector3(point + axis)));
  }
  void add_ball(const std::string& one, const std::string& two, const Vector3& point) {
    add_joint("Spherical", one, two, "BindPoint = " + at(point));
  }
  void add_slider(const std::string& one, const std::string& two, const Vector3& point, const Vector3& axis) {
    add_joint("Slider", one, two, "BindPoint = " + at(point) + " Axis = " + literal(axis));
  }
  void reverse() {
    std::ranges::reverse(bodies_);
    std::ranges::reverse(joints_);
  }

  const std::string& force() const { return force_; }
  const std::vector<std::string>& ids() const { return ids_; }
  std::string bodies() const { return together(bodies_); }
  std::string joints() const { return together(joints_); }

 private:
  std::string at(const Vector3& point) const { return literal(Vector3(place_ + size_ * point)); }
  void add_joint(const std::string& type, const std::string& one, const std::string& two, const std::string& where) {
    joints_.push_back("Constraint { Type = \"" + type + "\" Id = \"" + name_ + std::to_string(joints_.size()) + "\" " +
                      (one.empty() ? "" : "Body1 = \"" + name_ + one + "\" ") + "Body2 = \"" + name_ + two +
                      "\" CustomProperties { " + where + " } }\n");
  }
  static std::string together(const std::vector<std::string>& parts) {
    std::string all;
    for (const std::string& part : parts) all += part;
    return all;
  }

  std::string name_, force_;
  double size_, mass_;
  Vector3 place_;
  std::vector<std::string> ids_, bodies_, joints_;
};

const Vector3 kAcross = Vector3::UnitZ();

// Lies flat at the start and every half second, where it might go on as an antiparallelogram.
void flat_parallelogram(Linkage* linkage) {
  const double turn = 2.0 * kPi;
  const auto crank = [&](const std::string& id, double x) {
    linkage->add_body(id, 1.0, Vector3(0.001, 0.01, 0.01), Vector3(x, 0, 0), Vector3(0, 0.15 * turn, 0),
                      turn * kAcross);
  };
  crank("L", 0.15), crank("R", 0.95);
  linkage->add_body("C", 1.0, Vector3(0.001, 0.05, 0.05), Vector3(0.7, 0, 0), Vector3(0, 0.3 * turn, 0),
                    Vector3::Zero());
  linkage->add_hinge("", "L", Vector3(0, 0, 0), kAcross), linkage->add_hinge("L", "C", Vector3(0.3, 0, 0), kAcross);
  linkage->add_hinge("C", "R", Vector3(1.1, 0, 0), kAcross), linkage->add_hinge("", "R", Vector3(0.8, 0, 0), kAcross);
}

// Its three bars in a row: locked, however hard it is pushed.
void stretched_four_bar(Linkage* linkage) {
  const auto bar = [&](const std::string& id, double x) {
    linkage->add_body(id, 1.0, Vector3(0.01, 0.1, 0.1), Vector3(x, 0, 0), Vector3::Zero(), Vector3::Zero());
  };
  bar("A", 0.5), bar("B", 1.5), bar("C", 2.5);
  linkage->add_hinge("", "A", Vector3(0, 0, 0), kAcross), linkage->add_hinge("A", "B", Vector3(1, 0, 0), kAcross);
  linkage->add_hinge("B", "C", Vector3(2, 0, 0), kAcross), linkage->add_hinge("", "C", Vector3(3, 0, 0), kAcross);
}

// Four hinges in space, one freedom, and rows that depend on each other wherever it is.
void bennett(Linkage* linkage) {
  linkage->add_body("A", 0.5, Vector3(0.02, 0.03, 0.04), Vector3(0.13507557646703494, 0.21036774620197413, 0),
                    Vector3(-0.6311032385989642, 0.4052267293903894, 0), Vector3(0, 0, 3));
  linkage->add_body("B", 0.8, Vector3(0.05, 0.03, 0.04),
                    Vector3(-0.025188825763021727, 0.17084529876141352, 0.07765211028694366),
                    Vector3(-0.7393689906858802, 0.273156709999697, 0.2594858460785334),
                    Vector3(-0.5903768067859982, 0.379076588217991, 1.9744727966567477));
  linkage->add_body("C", 0.6, Vector3(0.02, 0.01, 0.02),
                    Vector3(-0.5548536343785249, -0.039522447440560576, 0.0776521102869436),
                    Vector3(-0.1082657520852547, -0.13207001940502985, 0.2594858460972378),
                    Vector3(0, -1.1073766537870982, -0.5636193972143742));
  linkage->add_hinge("", "A", Vector3(0, 0, 0), Vector3(0, 0, 1));
  linkage->add_hinge("A", "B", Vector3(0.2701511529340699, 0.42073549240394825, 0),
                     Vector3(0.4751302581520869, -0.3050776303664274, 0.8253356149096783));
  linkage->add_hinge("B", "C", Vector3(-0.32052880446011334, -0.07904489488112121, 0.15530422057388732),
                     Vector3(-0.1967922689226512, 0.4954844140215843, 0.8460307313295200));
  linkage->add_hinge("", "C", Vector3(-0.7891784642969364, 0, 0), Vector3(0, 0.8912073600614354, 0.45359612142557726));
}

// Crank and rod lie on each other where the slider is at the crank's axis, after 0.25 s and every half second.
void equal_slider_crank(Linkage* linkage) {
  const double turn = 2.0 * kPi;
  linkage->add_body("Crank", 1.0, Vector3(0.001, 0.01, 0.01), Vector3(0.15, 0, 0), Vector3(0, 0.15 * turn, 0),
                    turn * kAcross);
  linkage->add_body("Rod", 1.0, Vector3(0.001, 0.01, 0.01), Vector3(0.45, 0, 0), Vector3(0, 0.15 * turn, 0),
                    -turn * kAcross);
  linkage->add_body("Slider", 0.5, Vector3(0.01, 0.01, 0.01), Vector3(0.6, 0, 0), Vector3::Zero(), Vector3::Zero());
  linkage->add_hinge("", "Crank", Vector3(0, 0, 0), kAcross);
  linkage->add_hinge("Crank", "Rod", Vector3(0.3, 0, 0), kAcross);
  linkage->add_hinge("Rod", "Slider", Vector3(0.6, 0, 0), kAcross);
  linkage->add_slider("", "Slider", Vector3(0.6, 0, 0), Vector3::UnitX());
}

void heavy_top(Linkage* linkage) {
  linkage->add_body("Top", 2.0, Vector3(0.03, 0.02, 0.03), Vector3(0.1, 0.2, 0), Vector3(0, 0, -0.4),
                    Vector3(4, 50, 0));
  linkage->add_ball("", "Top", Vector3::Zero());
}

void chain(Linkage* linkage) {
  for (int i = 0; i < 6; ++i) {
    const std::string id = std::to_string(i), before = i == 0 ? "" : std::to_string(i - 1);
    linkage->add_body(id, 1.0, Vector3(0.002, 0.02, 0.02), Vector3(0.5 * i + 0.25, 0, 0), Vector3::Zero(),
                      Vector3::Zero());
    linkage->add_ball(before, id, Vector3(0.5 * i, 0, 0));
  }
}

struct Kind {
  const char* name;
  void (*add)(Linkage*);
  Vector3 gravity;
};

const std::vector<Kind>& kinds() {
  static const std::vector<Kind> all = {{"FlatParallelogram", flat_parallelogram, Vector3::Zero()},
                                        {"StretchedFourBar", stretched_four_bar, Vector3(0, -9.81, 0)},
                                        {"Bennett", bennett, Vector3(1, -4, -3)},
                                        {"EqualSliderCrank", equal_slider_crank, Vector3::Zero()},
                                        {"HeavyTop", heavy_top, Vector3(0, -9.81, 0)},
                                        {"Chain", chain, Vector3(0, -9.81, 0)}};
  return all;
}

Linkage make_linkage(const Kind& kind, const std::string& name, double size = 1.0, double mass = 1.0,
                     const Vector3& place = Vector3::Zero()) {
  Linkage linkage(name, size, mass, place, kind.gravity);
  kind.add(&linkage);
  return linkage;
}

std::string scene_of(const std::vector<Linkage>& linkages) {
  std::string forces, bodies, joints;
  for (const Linkage& linkage : linkages)
    forces += linkage.force(), bodies += linkage.bodies(), joints += linkage.joints();
  return "Forces { " + forces +
         "}\nSimulator { Type = \"Smooth\" CustomProperties { TimeStep = 0.01 Duration = 0.6 } }\n"
         "Environment { Space { Bodies { " +
         bodies + "} } Constraints { " + joints + "} }\n";
}

// All numbers of the linkage's states, step by step.
std::vector<double> states_of(const Linkage& linkage, const std::vector<Linkage>& linkages,
                              const std::vector<std::string>& of) {
  SceneRun run(scene_of(linkages), of);
  std::vector<double> states;
  while (!run.is_done()) {
    run.step();
    for (const std::string& id : linkage.ids()) {
      const auto [pose, twist] = run.body(id);
      for (const Vector3& part : {pose.position, Vector3(pose.orientation.vec()), twist.linear, twist.angular})
        states.insert(states.end(), part.begin(), part.end());
      states.push_back(pose.orientation.w());
    }
  }
  return states;
}

// Numbers until the first that differs; all of them where none does.
std::size_t alike(const std::vector<double>& one, const std::vector<double>& two) {
  return static_cast<std::size_t>(std::ranges::mismatch(one, two).in1 - one.begin());
}

void expect_alone_and_beside_alike(const Kind& kind, const std::vector<std::string>& of) {
  const Linkage mechanism = make_linkage(kind, "M");
  const std::vector<double> alone = states_of(mechanism, {mechanism}, of);
  ASSERT_TRUE(std::ranges::all_of(alone, [](double number) { return std::isfinite(number); }));
  for (const Kind& other : kinds()) {
    for (const double size : {1e-3, 1e3}) {
      for (const double mass : {1e-3, 1e3}) {
        Linkage beside = make_linkage(other, "O", size, mass, Vector3(0, 0, 7));
        const std::string what = std::string(kind.name) + " beside " + other.name + " x " + literal(size) + ", " +
                                 literal(mass) + ' ' + of[1];
        EXPECT_EQ(alike(alone, states_of(mechanism, {mechanism, beside}, of)), alone.size()) << what;
        if (size != mass) continue;
        EXPECT_EQ(alike(alone, states_of(mechanism, {beside, mechanism}, of)), alone.size())
            << what << ", listed first";
        beside.reverse();
        EXPECT_EQ(alike(alone, states_of(mechanism, {beside, mechanism}, of)), alone.size()) << what << ", reversed";
      }
    }
  }
}

class MechanismsSideBySide : public testing::TestWithParam<std::size_t> {};

TEST_P(MechanismsSideBySide, MoveAsTheyDoAloneBitForBit) {
  for (const char* solver : {"Direct", "Newton"})
    expect_alone_and_beside_alike(kinds()[GetParam()], {"Integrator=RK4", set("Solver", std::string(solver))});
}

// An adaptive integrator has its steps in common for all: what rests asks for none of its own.
TEST_P(MechanismsSideBySide, MoveByTheirOwnStepsBesideWhatRests) {
  const Kind resting = {"Resting", stretched_four_bar, Vector3::Zero()};
  const Linkage mechanism = make_linkage(kinds()[GetParam()], "M");
  for (const char* solver : {"Direct", "Newton"}) {
    const std::vector<std::string> of = {"Integrator=DormandPrince54", set("Solver", std::string(solver))};
    const std::vector<double> alone = states_of(mechanism, {mechanism}, of);
    for (const double scale : {1e-3, 1e3}) {
      const Linkage beside = make_linkage(resting, "O", scale, scale, Vector3(0, 0, 7));
      EXPECT_EQ(alike(alone, states_of(mechanism, {beside, mechanism}, of)), alone.size()) << solver << ' ' << scale;
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Kinds, MechanismsSideBySide, testing::Range(std::size_t{0}, std::size_t{6}),
                         [](const auto& tested) { return std::string(kinds()[tested.param].name); });

}  // namespace
}  // namespace gravitas
