// Queries against closed forms and brute force, on all hostings, and when their worker dies.
#include "services/survey/queries.h"

#include <fmt/format.h>
#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "plugin_sdk/geometry/ray.h"
#include "services/recorder/json.h"
#include "services/run/exchange_spec.h"
#include "tests/services/survey/surveyed_scene.h"

namespace gravitas::survey {
namespace {

using harness::SurveyedScene;
using harness::vector_of;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::SizeIs;

using Numbers = google::protobuf::RepeatedField<double>;

void put(const Vector3& v, Numbers* out) {
  for (int k = 0; k < 3; ++k) out->Add(v[k]);
}

query::v1::Ray* add_ray(const Vector3& origin, const Vector3& direction, query::v1::Batch* batch,
                        query::v1::Hits hits = query::v1::HITS_CLOSEST) {
  query::v1::Ray* ray = batch->add_rays();
  put(origin, ray->mutable_origin());
  put(direction, ray->mutable_direction());
  ray->set_hits(hits);
  return ray;
}

void set_ball(double radius, const Vector3& position, query::v1::Shape* shape) {
  shape->set_type("Sphere");
  query::v1::Property* property = shape->add_properties();
  property->set_name("Radius");
  property->set_value(std::to_string(radius));
  put(position, shape->mutable_position());
}

query::v1::Answers ask(SurveyedScene* scene, const query::v1::Batch& batch) {
  return answer(&*scene->surveyor, *scene->environment, batch);
}

template <typename Hits>
std::vector<std::string> bodies_of(const Hits& hits) {
  std::vector<std::string> ids;
  for (const auto& hit : hits) ids.push_back(hit.body());
  return ids;
}

// Three unit balls along x, and a plane below.
constexpr const char* kRow = R"(
Geometries {
  Geometry { Type = "Sphere" Id = "Unit" CustomProperties { Radius = 1 } }
  Geometry { Type = "Box" Id = "Cube" CustomProperties { HalfExtents = {1, 1, 1} } }
  Geometry { Type = "Halfspace" Id = "Plane" }
}
Environment { Space { Bodies {
  Body { Id = "A" GeometryId = "Unit" Mass = 1 KineticProperties { Position = {5, 2, 0} } }
  Body { Id = "B" GeometryId = "Unit" Mass = 1 KineticProperties { Position = {10, 2, 0} } }
  Body { Id = "C" GeometryId = "Cube" Mass = 1 KineticProperties { Position = {15, 2, 0} } }
  Body { Id = "Ground" GeometryId = "Plane" }
  Body { Id = "Ghost" Mass = 1 PrincipalMoments = {1, 1, 1} }
} } })";

TEST(Queries, RaysMeetWhatStandsInTheirWay) {
  SurveyedScene scene(kRow);
  query::v1::Batch batch;
  add_ray({0, 2, 0}, {2, 0, 0}, &batch);
  add_ray({0, 2, 0}, {1, 0, 0}, &batch, query::v1::HITS_ALL);
  add_ray({0, 2, 0}, {1, 0, 0}, &batch)->set_length(3.9);
  add_ray({0, 2, 0}, {1, 0, 0}, &batch)->mutable_filter()->add_except("A");
  add_ray({0, 2, 0}, {1, 0, 0}, &batch)->mutable_filter()->add_only("C");
  add_ray({0, 7, 0}, {0, -1, 0}, &batch);
  add_ray({5, 2, 0}, {0, 1, 0}, &batch, query::v1::HITS_ANY);
  const query::v1::Answers answers = ask(&scene, batch);
  ASSERT_THAT(answers.rays(), SizeIs(7));
  ASSERT_THAT(bodies_of(answers.rays(0).hits()), ElementsAre("A"));
  EXPECT_NEAR(answers.rays(0).hits(0).distance(), 4.0, 1e-12);
  EXPECT_TRUE(vector_of(answers.rays(0).hits(0).point()).isApprox(Vector3(4, 2, 0), 1e-12));
  EXPECT_TRUE(vector_of(answers.rays(0).hits(0).normal()).isApprox(Vector3(-1, 0, 0), 1e-12));
  EXPECT_THAT(bodies_of(answers.rays(1).hits()), ElementsAre("A", "B", "C"));
  EXPECT_THAT(answers.rays(2).hits(), IsEmpty());
  EXPECT_THAT(bodies_of(answers.rays(3).hits()), ElementsAre("B"));
  EXPECT_THAT(bodies_of(answers.rays(4).hits()), ElementsAre("C"));
  EXPECT_NEAR(answers.rays(4).hits(0).distance(), 14.0, 1e-12);
  EXPECT_THAT(bodies_of(answers.rays(5).hits()), ElementsAre("Ground"));
  EXPECT_NEAR(answers.rays(5).hits(0).distance(), 7.0, 1e-12);
  ASSERT_THAT(answers.rays(6).hits(), SizeIs(1)) << "it begins in A";
  EXPECT_EQ(answers.rays(6).hits(0).distance(), 0.0);
}

TEST(Queries, CastsStopWhereShapesTouch) {
  SurveyedScene scene(kRow);
  query::v1::Batch batch;
  const auto cast = [&](const Vector3& displacement) {
    query::v1::Cast* one = batch.add_casts();
    put(displacement, one->mutable_displacement());
    return one;
  };
  // a ball of 0.5 m: 1.5 m before A's centre
  set_ball(0.5, {0, 2, 0}, cast({10, 0, 0})->mutable_shape());
  // the way to the ground: 1 m of 10
  cast({0, -10, 0})->mutable_shape()->set_body("B");
  // a cube of the scene, all that it meets: A at 5 - 2, B at 10 - 2, C at 15 - 2
  query::v1::Cast* all = cast({20, 0, 0});
  all->mutable_shape()->set_geometry("Cube");
  put({0, 2, 0}, all->mutable_shape()->mutable_position());
  all->set_hits(query::v1::HITS_ALL);
  set_ball(0.5, {0, 40, 0}, cast({10, 0, 0})->mutable_shape());
  const query::v1::Answers answers = ask(&scene, batch);
  ASSERT_THAT(bodies_of(answers.casts(0).hits()), ElementsAre("A"));
  EXPECT_NEAR(answers.casts(0).hits(0).fraction(), 0.35, 1e-9);
  EXPECT_TRUE(vector_of(answers.casts(0).hits(0).normal()).isApprox(Vector3(1, 0, 0), 1e-6));
  EXPECT_NEAR(answers.casts(0).hits(0).gap(), 0.0, 1e-8);
  ASSERT_THAT(bodies_of(answers.casts(1).hits()), ElementsAre("Ground"));
  EXPECT_NEAR(answers.casts(1).hits(0).fraction(), 0.1, 1e-9);
  EXPECT_TRUE(vector_of(answers.casts(1).hits(0).normal()).isApprox(Vector3(0, -1, 0), 1e-6));
  ASSERT_THAT(bodies_of(answers.casts(2).hits()), ElementsAre("A", "B", "C"));
  EXPECT_NEAR(answers.casts(2).hits(0).fraction(), 0.15, 1e-9);
  EXPECT_NEAR(answers.casts(2).hits(2).fraction(), 0.65, 1e-9);
  EXPECT_THAT(answers.casts(3).hits(), IsEmpty());
}

TEST(Queries, OverlapAndDistanceAreThoseOfBalls) {
  SurveyedScene scene(kRow);
  query::v1::Batch batch;
  set_ball(2.5, {7.5, 2, 0}, batch.add_overlaps()->mutable_shape());
  batch.add_overlaps()->mutable_shape()->set_body("A");
  query::v1::ClosestPoints* near = batch.add_closest();
  near->mutable_shape()->set_body("A");
  near->set_distance(3.5);
  set_ball(0.25, {0, 10, 0}, (near = batch.add_closest())->mutable_shape());
  near->set_distance(1.0);
  const query::v1::Answers answers = ask(&scene, batch);
  ASSERT_THAT(bodies_of(answers.overlaps(0).hits()), ElementsAre("A", "B", "Ground"));
  EXPECT_NEAR(answers.overlaps(0).hits(0).depth(), 1.0, 1e-12);
  EXPECT_TRUE(vector_of(answers.overlaps(0).hits(0).normal()).isApprox(Vector3(-1, 0, 0), 1e-12));
  EXPECT_NEAR(answers.overlaps(0).hits(2).depth(), 0.5, 1e-12);
  EXPECT_THAT(answers.overlaps(1).hits(), IsEmpty()) << "a body is no answer to itself";
  ASSERT_THAT(bodies_of(answers.closest(0).hits()), ElementsAre("Ground", "B"));
  EXPECT_NEAR(answers.closest(0).hits(0).distance(), 1.0, 1e-12);
  EXPECT_NEAR(answers.closest(0).hits(1).distance(), 3.0, 1e-12);
  EXPECT_TRUE(vector_of(answers.closest(0).hits(1).point_on_shape()).isApprox(Vector3(6, 2, 0), 1e-12));
  EXPECT_TRUE(vector_of(answers.closest(0).hits(1).point_on_body()).isApprox(Vector3(9, 2, 0), 1e-12));
  EXPECT_THAT(answers.closest(1).hits(), IsEmpty());
}

// A ball and a box, wherever they are: the nearest point of a box is its centre's, clamped.
TEST(Queries, DistanceOfABallFromABoxAnywhere) {
  SurveyedScene scene(kRow);
  std::mt19937_64 random(3);
  const auto draw = [&](double reach) { return std::uniform_real_distribution<double>(-reach, reach)(random); };
  query::v1::Batch batch;
  std::vector<double> right;
  for (int i = 0; i < 300; ++i) {
    const Vector3 centre = Vector3(15, 2, 0) + Vector3{draw(4), draw(4), draw(4)};
    const Vector3 nearest = (centre - Vector3(15, 2, 0)).cwiseMax(-1.0).cwiseMin(1.0) + Vector3(15, 2, 0);
    const double distance = (centre - nearest).norm() - 0.25;
    if (!(distance > 0.0)) continue;
    query::v1::ClosestPoints* closest = batch.add_closest();
    set_ball(0.25, centre, closest->mutable_shape());
    closest->set_distance(10.0);
    closest->mutable_filter()->add_only("C");
    right.push_back(distance);
  }
  const query::v1::Answers answers = ask(&scene, batch);
  for (std::size_t i = 0; i < right.size(); ++i) {
    ASSERT_THAT(answers.closest(static_cast<int>(i)).hits(), SizeIs(1));
    const query::v1::ClosestHit& hit = answers.closest(static_cast<int>(i)).hits(0);
    EXPECT_NEAR(hit.distance(), right[i], 1e-6);
    EXPECT_NEAR((vector_of(hit.point_on_body()) - vector_of(hit.point_on_shape())).norm(), right[i], 1e-6);
  }
}

// Boxes corner to corner: the closest points are the corners.
TEST(Queries, BoxesAreClosestAtTheirCorners) {
  SurveyedScene scene(kRow);
  query::v1::Batch batch;
  query::v1::ClosestPoints* closest = batch.add_closest();
  closest->mutable_shape()->set_geometry("Cube");
  put({18, 5, 3}, closest->mutable_shape()->mutable_position());
  closest->set_distance(3.0);
  const query::v1::Answers answers = ask(&scene, batch);
  ASSERT_THAT(bodies_of(answers.closest(0).hits()), ElementsAre("C"));
  EXPECT_NEAR(answers.closest(0).hits(0).distance(), std::sqrt(3.0), 1e-6);
}

// Two flush tiles: contacts of a run are mended over their seam, answers are not, whatever else is asked beside.
TEST(Queries, TilesDoNotHideEachOther) {
  SurveyedScene scene(R"(
Geometries { Geometry { Type = "Box" Id = "Tile" CustomProperties { HalfExtents = {1, 0.5, 1} } } }
Environment { Space { Bodies {
  Body { Id = "A" GeometryId = "Tile" Immovable = true KineticProperties { Position = {0, -0.5, 0} } }
  Body { Id = "B" GeometryId = "Tile" Immovable = true KineticProperties { Position = {2, -0.5, 0} } }
} } })");
  query::v1::Batch batch;
  query::v1::ClosestPoints* closest = batch.add_closest();
  set_ball(0.1, {0.5, 0.3, 0}, closest->mutable_shape());
  closest->set_distance(1.0);
  for (const double x : {0.95, 0.5}) set_ball(0.1, {x, 0.05, 0}, batch.add_overlaps()->mutable_shape());
  const query::v1::Answers answers = ask(&scene, batch);
  ASSERT_THAT(bodies_of(answers.closest(0).hits()), ElementsAre("A", "B"));
  EXPECT_NEAR(answers.closest(0).hits(0).distance(), 0.2, 1e-12);
  EXPECT_NEAR(answers.closest(0).hits(1).distance(), std::hypot(0.5, 0.3) - 0.1, 1e-12);
  ASSERT_THAT(bodies_of(answers.overlaps(0).hits()), ElementsAre("A", "B"));
  EXPECT_NEAR(answers.overlaps(0).hits(0).depth(), 0.05, 1e-12);
  EXPECT_NEAR(answers.overlaps(0).hits(1).depth(), 0.1 - std::hypot(0.05, 0.05), 1e-12);
  EXPECT_THAT(bodies_of(answers.overlaps(1).hits()), ElementsAre("A"));
}

// ---- many

std::string crowd(int count, std::uint64_t seed, bool has_ground) {
  std::mt19937_64 random(seed);
  const auto draw = [&](double low, double high) { return std::uniform_real_distribution<double>(low, high)(random); };
  std::string text = R"(Geometries { Geometry { Type = "Halfspace" Id = "Plane" }
    Geometry { Type = "Sphere" Id = "S" CustomProperties { Radius = 0.4 } }
    Geometry { Type = "Box" Id = "B" CustomProperties { HalfExtents = {0.2, 0.5, 0.3} } }
    Geometry { Type = "Capsule" Id = "C" CustomProperties { Radius = 0.2 Height = 0.8 } } }
    Environment { Space { Bodies { )";
  for (int i = 0; i < count; ++i) {
    const Quaternion q = Quaternion{draw(-1, 1), draw(-1, 1), draw(-1, 1), draw(-1, 1)}.normalized();
    const auto number = [](double value) { return fmt::format("{:.17g}", value); };
    text += "Body { Id = \"N" + std::to_string(i) + "\" GeometryId = \"" + "SBC"[i % 3] +
            "\" Mass = 1 KineticProperties { Position = {" + number(draw(-4, 4)) + "," + number(draw(0, 6)) + "," +
            number(draw(-4, 4)) + "} Orientation = {" + number(q.w()) + "," + number(q.x()) + "," + number(q.y()) +
            "," + number(q.z()) + "} } }";
  }
  return text + (has_ground ? "Body { Id = \"Ground\" GeometryId = \"Plane\" }" : "") + "} } }";
}

query::v1::Batch many_rays(std::uint64_t seed, int count) {
  std::mt19937_64 random(seed);
  const auto draw = [&] { return std::uniform_real_distribution<double>(-5, 5)(random); };
  query::v1::Batch batch;
  for (int i = 0; i < count; ++i)
    add_ray({draw(), 3 + draw(), draw()}, {draw(), draw(), draw()}, &batch, query::v1::HITS_ALL)->set_length(20.0);
  return batch;
}

// Every ray with every body's own shape, one by one.
TEST(Queries, RaysAgreeWithBruteForceInEverySpace) {
  const query::v1::Batch batch = many_rays(5, 100);
  int met = 0;
  for (const char* space : {"DynamicBVH", "Basic", "Grid", "KDTree", "SweepAndPrune"}) {
    SurveyedScene scene(crowd(60, 4, true), kernel::Hosting::kDirect, {std::string("Space=") + space});
    const query::v1::Answers answers = ask(&scene, batch);
    EXPECT_EQ(scene.surveyor->slot(Slot::kSpace).questions(), 1U);
    for (int i = 0; i < batch.rays_size(); ++i) {
      const Ray ray{vector_of(batch.rays(i).origin()), vector_of(batch.rays(i).direction()).normalized(), 20.0};
      std::vector<std::pair<double, std::string>> right;
      for (const kernel::BodyDescription& body : scene.description.bodies) {
        const kernel::ShapeDescription& shape = scene.description.shapes[body.shape];
        std::string why;
        const auto hit = cast_ray(*read_scene_shape(type_id(shape.type), shape.parameters, &why),
                                  ray_in(compose(body.pose, body.geometry), ray));
        if (hit) right.emplace_back(hit->distance, body.id);
      }
      std::ranges::stable_sort(right, {}, &std::pair<double, std::string>::first);
      ASSERT_THAT(answers.rays(i).hits(), SizeIs(right.size())) << "ray " << i << ", " << space;
      for (std::size_t k = 0; k < right.size(); ++k) {
        EXPECT_EQ(answers.rays(i).hits(static_cast<int>(k)).body(), right[k].second);
        EXPECT_NEAR(answers.rays(i).hits(static_cast<int>(k)).distance(), right[k].first, 1e-9);
      }
      met += static_cast<int>(right.size());
    }
  }
  EXPECT_GT(met, 250);
}

// What overlaps by one question is at distance <= 0 by the other, and where a cast ends the shape touches.
TEST(Queries, CastsOverlapAndDistanceAgree) {
  SurveyedScene scene(crowd(60, 8, true));
  std::mt19937_64 random(9);
  const auto draw = [&] { return std::uniform_real_distribution<double>(-4, 4)(random); };
  query::v1::Batch batch;
  for (int i = 0; i < 60; ++i) {
    const Vector3 from{draw(), 3.5 + 0.8 * draw(), draw()}, way(draw(), draw(), draw());
    set_ball(0.3, from, batch.add_overlaps()->mutable_shape());
    query::v1::ClosestPoints* closest = batch.add_closest();
    set_ball(0.3, from, closest->mutable_shape());
    closest->set_distance(0.5);
    query::v1::Cast* cast = batch.add_casts();
    set_ball(0.3, from, cast->mutable_shape());
    put(way, cast->mutable_displacement());
  }
  const query::v1::Answers answers = ask(&scene, batch);
  query::v1::Batch then;
  std::vector<std::string> touched;
  for (int i = 0; i < 60; ++i) {
    std::vector<std::string> near;
    for (const query::v1::ClosestHit& hit : answers.closest(i).hits())
      if (hit.distance() <= 0.0) near.push_back(hit.body());
    std::ranges::sort(near);
    std::vector<std::string> overlapping = bodies_of(answers.overlaps(i).hits());
    std::ranges::sort(overlapping);
    EXPECT_EQ(near, overlapping);
    if (answers.casts(i).hits().empty()) continue;
    const query::v1::CastHit& hit = answers.casts(i).hits(0);
    if (!overlapping.empty()) {
      EXPECT_EQ(hit.fraction(), 0.0);
      continue;
    }
    query::v1::ClosestPoints* closest = then.add_closest();
    set_ball(0.3,
             vector_of(batch.casts(i).shape().position()) + hit.fraction() * vector_of(batch.casts(i).displacement()),
             closest->mutable_shape());
    closest->set_distance(0.01);
    touched.push_back(hit.body());
  }
  ASSERT_GT(touched.size(), 10U);
  const query::v1::Answers later = ask(&scene, then);
  for (std::size_t i = 0; i < touched.size(); ++i) {
    ASSERT_THAT(later.closest(static_cast<int>(i)).hits(), ::testing::Not(IsEmpty()));
    const query::v1::ClosestHit& hit = later.closest(static_cast<int>(i)).hits(0);
    EXPECT_EQ(hit.body(), touched[i]);
    EXPECT_NEAR(hit.distance(), 0.0, 1e-6);
  }
}

// ---- beside the run

TEST(Queries, AreTheSameOnAnyHostingAlsoWhenTheirWorkerDies) {
  const query::v1::Batch batch = many_rays(6, 20);
  std::string right;
  Hash chain;
  for (const kernel::Hosting hosting :
       {kernel::Hosting::kDirect, kernel::Hosting::kSharedMemory, kernel::Hosting::kGrpc}) {
    SCOPED_TRACE(kernel::hosting_name(hosting));
    SurveyedScene scene(crowd(20, 5, true), hosting);
    std::string answers;
    for (int i = 0; i < 4; ++i) {
      AskedSlot& collision = scene.surveyor->slot(Slot::kCollision);
      if (i == 2 && hosting != kernel::Hosting::kDirect)
        collision.inject({Slot::kCollision, "kill", collision.questions() + 1});
      answers += to_json(ask(&scene, batch), JsonForm::kLine);
      scene.steps(2);
    }
    const std::size_t died = hosting == kernel::Hosting::kDirect ? 0 : 1;
    EXPECT_THAT(scene.surveyor->slot(Slot::kCollision).faults(), SizeIs(died));
    EXPECT_THAT(scene.environment->faults(), IsEmpty());
    if (right.empty()) right = answers, chain = scene.environment->chain_hash();
    EXPECT_EQ(answers, right);
    EXPECT_EQ(scene.environment->chain_hash(), chain);
  }
  SurveyedScene quiet(crowd(20, 5, true));
  quiet.steps(8);
  EXPECT_EQ(quiet.environment->chain_hash(), chain) << "questions changed the run";
}

// After a swap the plugin that came in.
TEST(Queries, AreAnsweredByWhoAnswersInTheRun) {
  class Follower final : public kernel::CommitListener {
   public:
    explicit Follower(Surveyor* surveyor) : surveyor_(*surveyor) {}
    void on_commit(const kernel::Environment&) override {}
    void on_decision(const kernel::Environment&, const kernel::Decision& decision) override {
      surveyor_.follow(decision);
    }

   private:
    Surveyor& surveyor_;
  };
  SurveyedScene scene(kRow);
  Follower follower(&*scene.surveyor);
  scene.environment->set_commit_listener(&follower);
  query::v1::Batch batch;
  add_ray({0, 2, 0}, {1, 0, 0}, &batch);
  ASSERT_THAT(bodies_of(ask(&scene, batch).rays(0).hits()), ElementsAre("A"));
  scene.environment->order_swap(
      resolve_swap(parse_swap("collision=GjkOnly@step=2"), scene.description, &scene.catalog));
  scene.steps(3);
  const AskedSlot& collision = scene.surveyor->slot(Slot::kCollision);
  EXPECT_EQ(collision.description().plugins[0].declaration.name, "GjkOnly");
  const query::v1::Answers answers = ask(&scene, batch);
  ASSERT_THAT(bodies_of(answers.rays(0).hits()), ElementsAre("A"));
  EXPECT_NEAR(answers.rays(0).hits(0).distance(), 4.0, 1e-8);
  EXPECT_THAT(collision.faults(), IsEmpty());
}

// Nothing can touch here, so the plan has neither space nor collision; a ray finds what there is all the same.
TEST(Queries, WorkWhereThePlanLeftTheSlotsOut) {
  SurveyedScene scene(crowd(1, 5, false), kernel::Hosting::kSharedMemory);
  query::v1::Batch batch;
  add_ray(scene.description.bodies[0].pose.position + Vector3(0, 5, 0), {0, -1, 0}, &batch);
  const query::v1::Answers answers = ask(&scene, batch);
  ASSERT_THAT(bodies_of(answers.rays(0).hits()), ElementsAre("N0"));
  EXPECT_NEAR(answers.rays(0).hits(0).distance(), 4.6, 1e-9);
  EXPECT_EQ(scene.surveyor->slot(Slot::kSpace).process_id(), 0) << "the rule of the spaces is enough";
}

TEST(Queries, AMissingCapabilityIsNamed) {
  SurveyedScene scene(kRow);
  kernel::EnvironmentDescription without = scene.description;
  without.collision.plugins[0].declaration.capabilities.clear();
  Surveyor surveyor(without);
  query::v1::Batch batch;
  add_ray({0, 2, 0}, {1, 0, 0}, &batch);
  try {
    answer(&surveyor, *scene.environment, batch);
    FAIL();
  } catch (const NoAnswer& reason) {
    EXPECT_THAT(reason.what(), HasSubstr("'rays'"));
    EXPECT_THAT(reason.what(), HasSubstr("Standard"));
  }
}

TEST(Queries, MistakesNameTheirPlaceBeforeAnybodyIsAsked) {
  SurveyedScene scene(kRow, kernel::Hosting::kSharedMemory);
  const auto problem = [&](const query::v1::Batch& batch) -> std::string {
    try {
      ask(&scene, batch);
      return "";
    } catch (const BadQuestion& bad) {
      return bad.what();
    }
  };
  query::v1::Batch batch;
  add_ray({0, 0, 0}, {1, 0, 0}, &batch);
  add_ray({0, 0, 0}, {0, 0, 0}, &batch);
  EXPECT_THAT(problem(batch), HasSubstr("rays[1].direction"));
  batch.Clear();
  add_ray({0, 0, 0}, {1, 0, 0}, &batch)->mutable_filter()->add_only("Gruond");
  EXPECT_THAT(problem(batch), HasSubstr("did you mean \"Ground\"?"));
  batch.Clear();
  batch.add_overlaps()->mutable_shape()->set_body("Ghost");
  EXPECT_THAT(problem(batch), HasSubstr("'Ghost' has no geometry"));
  batch.Clear();
  set_ball(-1.0, {0, 0, 0}, batch.add_overlaps()->mutable_shape());
  EXPECT_THAT(problem(batch), HasSubstr("overlaps[0].shape.properties"));
  batch.Clear();
  batch.add_overlaps();
  EXPECT_THAT(problem(batch), HasSubstr("one of: body, geometry, type"));
  batch.Clear();
  batch.add_closest()->mutable_shape()->set_body("A");
  batch.mutable_closest(0)->set_distance(-1.0);
  EXPECT_THAT(problem(batch), HasSubstr("closest[0].distance"));
  EXPECT_EQ(scene.surveyor->slot(Slot::kCollision).questions(), 0U);
}

}  // namespace
}  // namespace gravitas::survey
