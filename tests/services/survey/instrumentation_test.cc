// Debug geometry of scenes of which it is known beforehand what there is to be seen.
#include "services/survey/instrumentation.h"

#include <gmock/gmock.h>

#include <algorithm>
#include <set>

#include "services/recorder/json.h"
#include "tests/services/survey/surveyed_scene.h"

namespace gravitas::survey {
namespace {

namespace v1 = instrumentation::v1;
using harness::SurveyedScene;
using harness::vector_of;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::SizeIs;

// A cube of 2 m and 3 kg that stands on a plane; a point in free fall.
constexpr const char* kBoxOnGround = R"(
Geometries {
  Geometry { Type = "Box" Id = "Cube" CustomProperties { HalfExtents = {1, 1, 1} } }
  Geometry { Type = "Halfspace" Id = "Plane" }
}
Forces { Force { Type = "Gravity" Id = "Down" CustomProperties { Acceleration = {0, -10, 0} } } }
Simulator { CustomProperties { TimeStep = 0.01 Duration = 1 SleepEnergy = 0 } }
Environment { Space { Bodies {
  Body { Id = "Ground" GeometryId = "Plane" }
  Body { Id = "Box" GeometryId = "Cube" Mass = 3 Forces = { "Down" } KineticProperties { Position = {5, 1, 0} } }
  Body { Id = "Stone" Mass = 2 PrincipalMoments = {1, 1, 1} Forces = { "Down" }
         KineticProperties { Position = {0, 50, 0} LinearVelocity = {1, 0, 0} } }
} } })";

Frame frame_of(SurveyedScene* scene, const std::vector<Kind>& kinds) {
  Instrumentation instrumentation(&*scene->surveyor);
  return instrumentation.frame(*scene->environment, kinds);
}

std::uint32_t questions(SurveyedScene* scene) {
  std::uint32_t sum = 0;
  for (const Slot slot : {Slot::kSpace, Slot::kCollision, Slot::kConstraint, Slot::kForce})
    sum += scene->surveyor->slot(slot).questions();
  return sum;
}

TEST(Instrumentation, ABoxOnTheGroundTouchesItAtItsCorners) {
  SurveyedScene scene(kBoxOnGround);
  const Frame frame = frame_of(&scene, {v1::KIND_CONTACT});
  ASSERT_THAT(frame.labels(), SizeIs(4));
  std::set<std::pair<double, double>> corners;
  for (const v1::Label& label : frame.labels()) {
    EXPECT_EQ(label.id(), "Ground/Box");
    EXPECT_NEAR(vector_of(label.position()).y(), 0.0, 1e-12);
    corners.emplace(std::round(vector_of(label.position()).x()), std::round(vector_of(label.position()).z()));
  }
  EXPECT_THAT(corners,
              ElementsAre(std::pair(4.0, -1.0), std::pair(4.0, 1.0), std::pair(6.0, -1.0), std::pair(6.0, 1.0)));
  ASSERT_THAT(frame.arrows(), SizeIs(4));
  for (const v1::Arrow& arrow : frame.arrows()) EXPECT_EQ(vector_of(arrow.vector()), Vector3(0, 1, 0));
  EXPECT_THAT(frame.missing(), IsEmpty());
}

// What holds it up is its weight.
TEST(Instrumentation, ReactionsCarryTheWeight) {
  SurveyedScene scene(kBoxOnGround);
  scene.steps(20);
  const Frame frame = frame_of(&scene, {v1::KIND_REACTION});
  Vector3 sum = Vector3::Zero();
  for (const v1::Arrow& arrow : frame.arrows()) {
    EXPECT_EQ(arrow.kind(), v1::KIND_REACTION);
    sum += vector_of(arrow.vector());
  }
  EXPECT_NEAR(sum.y(), 30.0, 1e-6);
  EXPECT_NEAR(sum.x(), 0.0, 1e-6);
  EXPECT_NEAR(sum.z(), 0.0, 1e-6);
}

TEST(Instrumentation, ForcesAreArrowsAtTheCentresOfMass) {
  SurveyedScene scene(kBoxOnGround);
  const Frame frame = frame_of(&scene, {v1::KIND_FORCE});
  ASSERT_THAT(frame.arrows(), SizeIs(2));
  EXPECT_EQ(frame.arrows(0).id(), "Down on Box");
  EXPECT_EQ(vector_of(frame.arrows(0).origin()), Vector3(5, 1, 0));
  EXPECT_EQ(vector_of(frame.arrows(0).vector()), Vector3(0, -30, 0));
  EXPECT_EQ(frame.arrows(1).id(), "Down on Stone");
  EXPECT_EQ(vector_of(frame.arrows(1).vector()), Vector3(0, -20, 0));
}

TEST(Instrumentation, BoundsAreThoseOfTheShapes) {
  SurveyedScene scene(kBoxOnGround);
  const Frame frame = frame_of(&scene, {v1::KIND_BOUNDS});
  ASSERT_THAT(frame.boxes(), SizeIs(1)) << "a plane and a point have no bounds";
  EXPECT_EQ(frame.boxes(0).id(), "Box");
  EXPECT_TRUE(vector_of(frame.boxes(0).centre()).isApprox(Vector3(5, 1, 0), 1e-12));
  EXPECT_TRUE(vector_of(frame.boxes(0).half_extents()).isApprox(Vector3(1, 1, 1), 1e-12));
}

TEST(Instrumentation, TrajectoriesJoinWhereABodyWasAndIs) {
  SurveyedScene scene(kBoxOnGround);
  Instrumentation instrumentation(&*scene.surveyor);
  EXPECT_THAT(instrumentation.frame(*scene.environment, {v1::KIND_TRAJECTORY}).lines(), IsEmpty());
  scene.steps(3);
  const Frame frame = instrumentation.frame(*scene.environment, {v1::KIND_TRAJECTORY});
  const auto stone = std::ranges::find(frame.lines(), "Stone", &v1::Line::id);
  ASSERT_NE(stone, frame.lines().end());
  EXPECT_EQ(vector_of(stone->from()), Vector3(0, 50, 0));
  EXPECT_EQ(vector_of(stone->to()), vector_at(scene.environment->state().position, 2));
}

TEST(Instrumentation, ACubeHasTwelveEdgesAlsoAsAHull) {
  // the hull's faces are found, and coplanar triangles merged
  constexpr const char* kHull = R"(
Geometries { Geometry { Type = "ConvexPolyhedron" Id = "Cube" CustomProperties {
  Vertices = {{1,1,1},{-1,1,1},{1,-1,1},{-1,-1,1},{1,1,-1},{-1,1,-1},{1,-1,-1},{-1,-1,-1}} } } }
Environment { Space { Bodies { Body { Id = "Box" GeometryId = "Cube" Mass = 3 } } } })";
  for (const char* text : {kBoxOnGround, kHull}) {
    SurveyedScene scene(text);
    const Frame frame = frame_of(&scene, {v1::KIND_SHAPE});
    std::set<std::string> edges;
    for (const v1::Line& line : frame.lines()) {
      if (line.id() != "Box") continue;
      const Vector3 from = vector_of(line.from()), to = vector_of(line.to());
      EXPECT_NEAR((to - from).norm(), 2.0, 1e-12);
      edges.insert(to_json(line, JsonForm::kLine));
    }
    EXPECT_THAT(edges, SizeIs(12));
  }
}

// The nodes over a mesh: the root is its box, every node lies in its parent.
TEST(Instrumentation, NodesOfAMeshLieInTheirParents) {
  std::string vertices, faces;
  for (int x = 0; x <= 8; ++x)
    for (int z = 0; z <= 8; ++z)
      vertices += "{" + std::to_string(x) + "," + std::to_string((x * 7 + z * 3) % 5) + "," + std::to_string(z) + "},";
  for (int x = 0; x < 8; ++x)
    for (int z = 0; z < 8; ++z) {
      const int corner = 9 * x + z;
      faces += "{" + std::to_string(corner) + "," + std::to_string(corner + 1) + "," + std::to_string(corner + 10) +
               "," + std::to_string(corner + 9) + "},";
    }
  vertices.pop_back(), faces.pop_back();
  SurveyedScene scene(R"(Geometries { Geometry { Type = "TriangleMesh" Id = "Field" CustomProperties { Vertices = {)" +
                      vertices + "} Faces = {" + faces + R"(} } } }
Environment { Space { Bodies { Body { Id = "Ground" GeometryId = "Field" Immovable = true
  KineticProperties { Position = {100, 0, 0} } } } } })");
  const Frame frame = frame_of(&scene, {v1::KIND_TREE});
  ASSERT_GT(frame.boxes_size(), 20);
  std::vector<const v1::Box*> path;  // from the root to the node
  for (const v1::Box& box : frame.boxes()) {
    ASSERT_LE(box.depth(), path.size());
    path.resize(box.depth());
    if (!path.empty()) {
      const Vector3 off = (vector_of(box.centre()) - vector_of(path.back()->centre())).cwiseAbs();
      EXPECT_TRUE(
          ((off + vector_of(box.half_extents())).array() <= vector_of(path.back()->half_extents()).array() + 1e-9)
              .all());
    }
    path.push_back(&box);
  }
  EXPECT_TRUE(vector_of(frame.boxes(0).centre()).isApprox(Vector3(104, 2, 4), 1e-9));
  EXPECT_TRUE(vector_of(frame.boxes(0).half_extents()).isApprox(Vector3(4, 2, 4), 1e-9));
}

TEST(Instrumentation, NodesOfASpaceHoldTheBodies) {
  for (const char* space : {"DynamicBVH", "KDTree", "Grid"}) {
    SCOPED_TRACE(space);
    SurveyedScene scene(kBoxOnGround, kernel::Hosting::kDirect, {std::string("Space=") + space});
    const Frame frame = frame_of(&scene, {v1::KIND_SPACE});
    EXPECT_THAT(frame.missing(), IsEmpty());
    const bool is_held = std::ranges::any_of(frame.boxes(), [](const v1::Box& box) {
      const Vector3 off = (Vector3(5, 1, 0) - vector_of(box.centre())).cwiseAbs();
      return (off.array() <= vector_of(box.half_extents()).array()).all();
    });
    EXPECT_TRUE(is_held) << to_json(frame, JsonForm::kPage);
  }
  SurveyedScene scene(kBoxOnGround, kernel::Hosting::kDirect, {"Space=Basic"});
  const Frame frame = frame_of(&scene, {v1::KIND_SPACE, v1::KIND_BOUNDS});
  EXPECT_THAT(frame.missing(), ElementsAre(HasSubstr("Basic")));
  EXPECT_THAT(frame.boxes(), SizeIs(1)) << "the other kind is there";
}

TEST(Instrumentation, AnchorsOfAJointAreWhereItHoldsTheBodies) {
  SurveyedScene scene(R"(
Environment {
  Space { Bodies { Body { Id = "Bob" Mass = 1 PrincipalMoments = {1, 1, 1}
    KineticProperties { Position = {3, 4, 0} } } } }
  Constraints { Constraint { Type = "Spherical" Id = "Pivot" Body1 = "Bob"
    CustomProperties { BindPoint = {0, 4, 0} } } }
})");
  const Frame frame = frame_of(&scene, {v1::KIND_JOINT});
  ASSERT_THAT(frame.labels(), SizeIs(1));
  EXPECT_EQ(frame.labels(0).id(), "Pivot");
  EXPECT_EQ(vector_of(frame.labels(0).position()), Vector3(0, 4, 0));
  ASSERT_THAT(frame.lines(), SizeIs(1)) << "the two anchors are one point";
  EXPECT_EQ(vector_of(frame.lines(0).from()), Vector3(3, 4, 0));
  EXPECT_EQ(vector_of(frame.lines(0).to()), Vector3(0, 4, 0));
}

// Neither a call nor a process for what is not asked for.
TEST(Instrumentation, KindsThatAreOffAreAbsentAndCostNothing) {
  SurveyedScene scene(kBoxOnGround, kernel::Hosting::kSharedMemory);
  for (const Kind kind : {v1::KIND_BOUNDS, v1::KIND_TRAJECTORY}) frame_of(&scene, {kind});
  EXPECT_EQ(questions(&scene), 0U);
  for (const Slot slot : {Slot::kSpace, Slot::kCollision, Slot::kForce})
    EXPECT_EQ(scene.surveyor->slot(slot).process_id(), 0);
  for (const Kind kind : all_kinds()) {
    const Frame frame = frame_of(&scene, {kind});
    const auto is_kind = [&](const auto& part) { return part.kind() == kind; };
    EXPECT_TRUE(std::ranges::all_of(frame.lines(), is_kind)) << kind_name(kind);
    EXPECT_TRUE(std::ranges::all_of(frame.arrows(), is_kind)) << kind_name(kind);
    EXPECT_TRUE(std::ranges::all_of(frame.boxes(), is_kind)) << kind_name(kind);
    EXPECT_TRUE(std::ranges::all_of(frame.labels(), is_kind)) << kind_name(kind);
  }
}

// On every hosting the same frames and the same chain, and a worker that dies of a question is replaced.
TEST(Instrumentation, IsTheSameOnAnyHostingAndChangesNoBitOfTheRun) {
  const auto chain_without = [] {
    SurveyedScene scene(kBoxOnGround);
    scene.steps(5);
    return scene.environment->chain_hash();
  }();
  std::string right;
  for (const kernel::Hosting hosting :
       {kernel::Hosting::kDirect, kernel::Hosting::kSharedMemory, kernel::Hosting::kGrpc}) {
    SCOPED_TRACE(kernel::hosting_name(hosting));
    SurveyedScene scene(kBoxOnGround, hosting);
    Instrumentation instrumentation(&*scene.surveyor);
    std::string frames;
    for (int i = 0; i < 5; ++i) {
      const bool kills = i == 3 && hosting != kernel::Hosting::kDirect;
      AskedSlot& collision = scene.surveyor->slot(Slot::kCollision);
      if (kills) collision.inject({Slot::kCollision, "kill", collision.questions() + 1});
      frames += to_json(instrumentation.frame(*scene.environment, all_kinds()), JsonForm::kLine);
      EXPECT_THAT(collision.faults(), SizeIs(i >= 3 && hosting != kernel::Hosting::kDirect ? 1 : 0));
      scene.steps(1);
    }
    if (right.empty()) right = frames;
    EXPECT_EQ(frames, right);
    EXPECT_EQ(scene.environment->chain_hash(), chain_without);
    EXPECT_THAT(scene.environment->faults(), IsEmpty());
  }
}

TEST(Instrumentation, UnknownKindsAreRefusedWithThoseThereAre) {
  EXPECT_EQ(find_kind("tree"), v1::KIND_TREE);
  try {
    find_kind("contacts");
    FAIL();
  } catch (const std::invalid_argument& problem) {
    EXPECT_THAT(problem.what(), HasSubstr("did you mean \"contact\"?"));
  }
}

}  // namespace
}  // namespace gravitas::survey
