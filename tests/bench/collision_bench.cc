// What a pair costs the collision plugins, and Bullet where it is there, on the same bodies.
//
//   collision/<plugin|Bullet>/<pair>      contacts of a thousand pairs that overlap by about a centimetre
//   impact/<plugin>/<pair>                times of impact of a thousand pairs that meet half-way, turning by about a radian
//   distance/<Gravitas|FCL>/<pair>        the distance of pairs some decimetres apart, without a plugin around it
//
// Shapes are of about a metre: boxes, hulls of 32 points, balls on a bumpy field of 20,000 triangles. Bodies lie a little
// elsewhere in each call, as from step to step. A call of ours reads the whole request and writes the whole reply; Bullet
// keeps an algorithm and a manifold per pair between calls, as its world does, and computes in single precision.
#include <benchmark/benchmark.h>

#include <cmath>
#include <memory>
#include <string>
#include <vector>

#include "plugin_sdk/body.h"
#include "plugin_sdk/geometry/penetration.h"
#include "plugin_sdk/geometry/scene_shape.h"
#include "plugin_sdk/library.h"
#include "plugin_sdk/message_columns.h"
#include "tests/bench/thread_clock.h"
#include "tests/paths.h"
#include "tests/plugin_sdk/geometry/random_shapes.h"

#ifdef GRAVITAS_HAS_BULLET
#include <BulletCollision/CollisionShapes/btBvhTriangleMeshShape.h>
#include <BulletCollision/CollisionShapes/btTriangleMesh.h>
#include <btBulletCollisionCommon.h>
#endif
#ifdef GRAVITAS_HAS_FCL
#include <fcl/narrowphase/distance.h>
#endif

namespace gravitas {
namespace {

using Kind = SceneShape::Kind;
constexpr std::size_t kPairs = 1000;
constexpr std::size_t kVariants = 8;  // of the poses

double bump(double x, double z) { return 0.3 * std::sin(0.9 * x) * std::cos(0.7 * z); }

std::shared_ptr<const SceneShape> bumpy_field() {
  constexpr std::uint32_t kSquares = 100;
  std::vector<Vector3> vertices;
  std::vector<TriangleMesh::Triangle> triangles;
  for (std::uint32_t i = 0; i <= kSquares; ++i) {
    for (std::uint32_t k = 0; k <= kSquares; ++k) {
      const double x = i - 0.5 * kSquares, z = k - 0.5 * kSquares;
      vertices.emplace_back(x, bump(x, z), z);
      if (i == kSquares || k == kSquares) continue;
      const std::uint32_t a = i * (kSquares + 1) + k, b = a + kSquares + 1;
      triangles.push_back({a, a + 1, b + 1});
      triangles.push_back({a, b + 1, b});
    }
  }
  std::string why;
  auto shape = std::make_shared<SceneShape>();
  shape->kind = Kind::kTriangleMesh;
  shape->size.setOnes();
  shape->mesh = std::make_shared<TriangleMesh>(*TriangleMesh::make(vertices, triangles, {}, &why));
  return shape;
}

struct PairOfShapes {
  std::shared_ptr<const SceneShape> a, b;
  Pose X_WA;
  std::vector<Pose> X_WB;  // one per variant
};

// Pairs that overlap by `depth` (m), or are apart by minus as much.
std::vector<PairOfShapes> make_pairs(const std::string& name, double depth) {
  test::RandomShapes random(7);
  std::vector<PairOfShapes> pairs;
  const auto field = name == "ball-mesh" ? bumpy_field() : nullptr;
  const auto shape = [&]() -> std::shared_ptr<const SceneShape> {
    SceneShape made = random.convex(name == "hull-hull" ? Kind::kConvexPolyhedron : Kind::kBox);
    if (name == "hull-hull") made.polyhedron = random.hull(32, random.vector(0.5, 1.0));
    return std::make_shared<SceneShape>(std::move(made));
  };
  for (std::size_t i = 0; i < kPairs; ++i) {
    PairOfShapes pair;
    Pose X_WB;
    if (field) {
      SceneShape ball;
      ball.size.setConstant(random.uniform(0.3, 1.0));
      const double x = random.uniform(-40, 40), z = random.uniform(-40, 40);
      X_WB.position = Vector3(x, bump(x, z) + ball.size.x() - depth, z);
      pair.a = field, pair.b = std::make_shared<SceneShape>(ball);
    } else {
      pair.a = shape(), pair.b = shape();
      pair.X_WA = {random.vector(-20, 20), random.rotation()};
      X_WB = {pair.X_WA.position + 1.0 * random.direction(), random.rotation()};
      const auto map_a = make_support_map(*pair.a), map_b = make_support_map(*pair.b);
      const Pose X_AB = relative(pair.X_WA, X_WB);
      const Separation least =
          find_separation({*map_a, *map_b, X_AB.orientation.toRotationMatrix(), X_AB.position}, 1e9);
      X_WB.position += (least.depth - depth) * (pair.X_WA.orientation * least.normal);
    }
    for (std::size_t k = 0; k < kVariants; ++k)
      pair.X_WB.push_back({X_WB.position + 1e-3 * random.direction(), X_WB.orientation});
    pairs.push_back(std::move(pair));
  }
  return pairs;
}

// ---- plugins

class PluginUnderLoad {
 public:
  PluginUnderLoad(const std::string& library, stage::Method method, const std::vector<PairOfShapes>& pairs)
      : method_(method) {
    std::string problem;
    const PluginLibrary loaded = load_plugin_library(in_build("/lib/gravitas/collision_") + library + ".so", &problem);
    if (loaded.table == nullptr) throw std::runtime_error(problem);
    table_ = loaded.table;
    gravitas_error error{};
    if (table_->create(nullptr, 0, &instance_, &error) != GRAVITAS_OK) throw std::runtime_error(error.text);
    host_.mark_progress = [](void*) {};
    host_.parallel_for = [](void*, std::uint64_t count, void (*body)(void*, std::uint64_t, std::uint64_t),
                            void* argument) { body(argument, 0, count); };
    for (std::size_t k = 0; k < kVariants; ++k) requests_.push_back(request_of(pairs, k));
    for (const stage::ColumnInfo& column : stage::method_info(method).reply) {
      room_.emplace_back(kPairs * 8 * column.components);
      reply_.push_back({room_.back().data(), room_.back().size(), 0});
    }
  }
  ~PluginUnderLoad() { table_->destroy(instance_); }
  PluginUnderLoad(const PluginUnderLoad&) = delete;
  PluginUnderLoad& operator=(const PluginUnderLoad&) = delete;

  // How many contacts or impacts.
  std::size_t ask(std::size_t variant) {
    gravitas_error error{};
    for (gravitas_reply_column& column : reply_) column.count = 0;
    const std::vector<gravitas_column> columns = requests_[variant].plain();
    if (table_->call(instance_, static_cast<std::uint32_t>(method_), columns.data(), reply_.data(), &host_, &error) !=
        GRAVITAS_OK)
      throw std::runtime_error(error.text);
    return reply_[0].count;
  }

 private:
  MessageColumns request_of(const std::vector<PairOfShapes>& pairs, std::size_t variant) const {
    MessageColumns request(stage::method_info(method_).request);
    request.u32("shape_parameter_begin") = {0};
    const bool moves = method_ == stage::Method::kCollisionTimesOfImpact;
    request.f64(moves ? "target_gap" : "margin") = {moves ? 1e-4 : 0.0};
    std::vector<const SceneShape*> known;
    const auto put = [&](const char* column, std::initializer_list<double> numbers) {
      request.f64(column).insert(request.f64(column).end(), numbers);
    };
    const auto add = [&](const SceneShape& shape, const Pose& pose, const Vector3& way, const Vector3& turn) {
      std::size_t row = 0;
      while (row < known.size() && known[row] != &shape) ++row;
      if (row == known.size()) {
        known.push_back(&shape);
        const std::vector<double> numbers = flattened_shape(shape);
        std::vector<double>& all = request.f64("shape_parameter");
        all.insert(all.end(), numbers.begin(), numbers.end());
        request.u32("shape_parameter_begin").push_back(static_cast<std::uint32_t>(all.size()));
        request.u64("shape_type").push_back(type_of(shape));
        request.u64("shape_hash").push_back(row + 1);
      }
      request.u32("body_shape").push_back(static_cast<std::uint32_t>(row));
      request.u32("pair").push_back(static_cast<std::uint32_t>(request.u32("pair").size()));
      const Vector3& p = pose.position;
      const Quaternion& q = pose.orientation;
      put("geometry_position", {0, 0, 0}), put("geometry_orientation", {1, 0, 0, 0});
      put("position", {p.x(), p.y(), p.z()}), put("orientation", {q.w(), q.x(), q.y(), q.z()});
      put(moves ? "displacement" : "linear_velocity", {way.x(), way.y(), way.z()});
      put(moves ? "rotation" : "angular_velocity", {turn.x(), turn.y(), turn.z()});
    };
    for (const PairOfShapes& pair : pairs) {
      const Pose& X_WB = pair.X_WB[variant];
      const Vector3 line = pair.a->mesh ? Vector3(0, 1, 0) : Vector3((X_WB.position - pair.X_WA.position).normalized());
      add(*pair.a, pair.X_WA, Vector3::Zero(), pair.a->mesh ? Vector3::Zero() : Vector3(0.3, 0.6, -0.7));
      add(*pair.b, {X_WB.position + (moves ? 1.0 : 0.0) * line, X_WB.orientation}, -2.0 * line, {-0.5, 0.8, 0.2});
    }
    return request;
  }

  stage::Method method_;
  const gravitas_plugin_table* table_ = nullptr;
  void* instance_ = nullptr;
  gravitas_host host_{};
  std::vector<MessageColumns> requests_;
  std::vector<std::vector<double>> room_;
  std::vector<gravitas_reply_column> reply_;
};

// ---- peers

#ifdef GRAVITAS_HAS_BULLET

btVector3 of(const Vector3& v) {
  return {static_cast<btScalar>(v.x()), static_cast<btScalar>(v.y()), static_cast<btScalar>(v.z())};
}
btTransform of(const Pose& pose) {
  const Quaternion& q = pose.orientation;
  return btTransform(btQuaternion(static_cast<btScalar>(q.x()), static_cast<btScalar>(q.y()),
                                  static_cast<btScalar>(q.z()), static_cast<btScalar>(q.w())),
                     of(pose.position));
}

class BulletUnderLoad {
 public:
  BulletUnderLoad(const std::string&, stage::Method, const std::vector<PairOfShapes>& pairs) : pairs_(pairs) {
    for (const PairOfShapes& pair : pairs) {
      objects_.push_back(object_of(pair.a, pair.X_WA));
      objects_.push_back(object_of(pair.b, pair.X_WB[0]));
      const btCollisionObjectWrapper a(nullptr, objects_.end()[-2]->getCollisionShape(), objects_.end()[-2].get(),
                                       objects_.end()[-2]->getWorldTransform(), -1, -1);
      const btCollisionObjectWrapper b(nullptr, objects_.back()->getCollisionShape(), objects_.back().get(),
                                       objects_.back()->getWorldTransform(), -1, -1);
      algorithms_.push_back(dispatcher_.findAlgorithm(&a, &b, nullptr, BT_CONTACT_POINT_ALGORITHMS));
    }
  }
  ~BulletUnderLoad() {
    for (btCollisionAlgorithm* algorithm : algorithms_) {
      algorithm->~btCollisionAlgorithm();
      dispatcher_.freeCollisionAlgorithm(algorithm);
    }
  }
  BulletUnderLoad(const BulletUnderLoad&) = delete;
  BulletUnderLoad& operator=(const BulletUnderLoad&) = delete;

  std::size_t ask(std::size_t variant) {
    btDispatcherInfo info;
    for (std::size_t i = 0; i < pairs_.size(); ++i) {
      btCollisionObject &a = *objects_[2 * i], &b = *objects_[2 * i + 1];
      b.setWorldTransform(of(pairs_[i].X_WB[variant]));
      const btCollisionObjectWrapper wrapped_a(nullptr, a.getCollisionShape(), &a, a.getWorldTransform(), -1, -1);
      const btCollisionObjectWrapper wrapped_b(nullptr, b.getCollisionShape(), &b, b.getWorldTransform(), -1, -1);
      btManifoldResult result(&wrapped_a, &wrapped_b);
      algorithms_[i]->processCollision(&wrapped_a, &wrapped_b, info, &result);
    }
    std::size_t contacts = 0;
    for (int i = 0; i < dispatcher_.getNumManifolds(); ++i)
      contacts += static_cast<std::size_t>(dispatcher_.getManifoldByIndexInternal(i)->getNumContacts());
    return contacts;
  }

 private:
  std::unique_ptr<btCollisionObject> object_of(const std::shared_ptr<const SceneShape>& shape, const Pose& pose) {
    auto object = std::make_unique<btCollisionObject>();
    object->setCollisionShape(shape_of(*shape));
    object->setWorldTransform(of(pose));
    return object;
  }
  btCollisionShape* shape_of(const SceneShape& shape) {
    if (shape.mesh && field_ != nullptr) return field_;
    if (shape.mesh) {
      mesh_ = std::make_unique<btTriangleMesh>();
      for (std::uint32_t t = 0; t < shape.mesh->triangles().size(); ++t) {
        const std::array<Vector3, 3> x = shape.mesh->corners(t);
        mesh_->addTriangle(of(x[0]), of(x[1]), of(x[2]));
      }
      field_ = keep(std::make_unique<btBvhTriangleMeshShape>(mesh_.get(), true));
      return field_;
    }
    if (shape.kind == Kind::kSphere)
      return keep(std::make_unique<btSphereShape>(static_cast<btScalar>(shape.size.x())));
    if (shape.kind == Kind::kBox) return keep(std::make_unique<btBoxShape>(of(shape.size)));
    auto hull = std::make_unique<btConvexHullShape>();
    for (const Vector3& v : shape.polyhedron->vertices) hull->addPoint(of(v), false);
    hull->recalcLocalAabb();
    hull->setMargin(0.0F);
    return keep(std::move(hull));
  }
  btCollisionShape* keep(std::unique_ptr<btCollisionShape> shape) {
    return shapes_.emplace_back(std::move(shape)).get();
  }

  const std::vector<PairOfShapes>& pairs_;
  btDefaultCollisionConfiguration configuration_;
  btCollisionDispatcher dispatcher_{&configuration_};
  std::unique_ptr<btTriangleMesh> mesh_;
  btCollisionShape* field_ = nullptr;
  std::vector<std::unique_ptr<btCollisionShape>> shapes_;
  std::vector<std::unique_ptr<btCollisionObject>> objects_;
  std::vector<btCollisionAlgorithm*> algorithms_;
};

#endif

class DistanceUnderLoad {
 public:
  DistanceUnderLoad(const std::string&, stage::Method, const std::vector<PairOfShapes>& pairs) : pairs_(pairs) {
    for (const PairOfShapes& pair : pairs)
      maps_.push_back(make_support_map(*pair.a)), maps_.push_back(make_support_map(*pair.b));
  }
  std::size_t ask(std::size_t variant) {
    double sum = 0.0;
    for (std::size_t i = 0; i < pairs_.size(); ++i) {
      const Pose X_AB = relative(pairs_[i].X_WA, pairs_[i].X_WB[variant]);
      sum -=
          find_separation({*maps_[2 * i], *maps_[2 * i + 1], X_AB.orientation.toRotationMatrix(), X_AB.position}, 1e9)
              .depth;
    }
    benchmark::DoNotOptimize(sum);
    return pairs_.size();
  }

 private:
  const std::vector<PairOfShapes>& pairs_;
  std::vector<std::unique_ptr<SupportMap>> maps_;
};

#ifdef GRAVITAS_HAS_FCL

class FclUnderLoad {
 public:
  FclUnderLoad(const std::string&, stage::Method, const std::vector<PairOfShapes>& pairs) : pairs_(pairs) {
    for (const PairOfShapes& pair : pairs) shapes_.push_back(shape_of(*pair.a)), shapes_.push_back(shape_of(*pair.b));
    request_.gjk_solver_type = fcl::GST_LIBCCD;
  }
  std::size_t ask(std::size_t variant) {
    double sum = 0.0;
    for (std::size_t i = 0; i < pairs_.size(); ++i) {
      fcl::DistanceResultd result;
      sum += fcl::distance(shapes_[2 * i].get(), of(pairs_[i].X_WA), shapes_[2 * i + 1].get(),
                           of(pairs_[i].X_WB[variant]), request_, result);
    }
    benchmark::DoNotOptimize(sum);
    return pairs_.size();
  }

 private:
  static fcl::Transform3d of(const Pose& pose) {
    fcl::Transform3d X = fcl::Transform3d::Identity();
    X.linear() = pose.orientation.toRotationMatrix(), X.translation() = pose.position;
    return X;
  }
  static std::unique_ptr<fcl::CollisionGeometryd> shape_of(const SceneShape& shape) {
    if (shape.kind == Kind::kBox) return std::make_unique<fcl::Boxd>(2.0 * shape.size);
    auto vertices = std::make_shared<std::vector<Vector3>>(shape.polyhedron->vertices);
    auto faces = std::make_shared<std::vector<int>>();
    for (const ConvexPolyhedron::Face& face : shape.polyhedron->faces) {
      faces->push_back(static_cast<int>(face.count));
      for (const std::uint32_t corner : shape.polyhedron->corners_of(face)) faces->push_back(static_cast<int>(corner));
    }
    return std::make_unique<fcl::Convexd>(vertices, static_cast<int>(shape.polyhedron->faces.size()), faces);
  }

  const std::vector<PairOfShapes>& pairs_;
  std::vector<std::unique_ptr<fcl::CollisionGeometryd>> shapes_;
  fcl::DistanceRequestd request_;
};

#endif

// ---- the benchmarks

template <typename Subject>
void add(const std::string& title, const std::string& library, stage::Method method, const std::string& kind,
         double depth) {
  benchmark::internal::Benchmark* const bench =
      benchmark::RegisterBenchmark((title + "/" + kind).c_str(), [=](benchmark::State& state) {
        const std::vector<PairOfShapes> pairs = make_pairs(kind, depth);
        Subject subject(library, method, pairs);
        std::size_t variant = 0, found = 0;
        double seconds = 0.0;
        // caches and room
        for (std::size_t i = 0; i < kVariants; ++i) subject.ask(i);
        for (auto _ : state) {
          variant = (variant + 1) % kVariants;
          const double start = thread_seconds();
          found = subject.ask(variant);
          const double spent = thread_seconds() - start;
          seconds += spent;
          state.SetIterationTime(spent);
        }
        state.counters["ns_per_pair"] = 1e9 * seconds / static_cast<double>(state.iterations() * kPairs);
        state.counters["found"] = static_cast<double>(found);
      });
  bench->UseManualTime()->MinTime(0.05)->Unit(benchmark::kMicrosecond);
}

const bool kAreAdded = [] {
  constexpr stage::Method kContacts = stage::Method::kCollisionManifolds;
  constexpr stage::Method kImpacts = stage::Method::kCollisionTimesOfImpact;
  for (const char* kind : {"box-box", "hull-hull", "ball-mesh"}) {
    add<PluginUnderLoad>("collision/Standard", "standard", kContacts, kind, 0.01);
    if (std::string(kind) != "ball-mesh") add<PluginUnderLoad>("collision/GjkOnly", "gjk_only", kContacts, kind, 0.01);
#ifdef GRAVITAS_HAS_BULLET
    add<BulletUnderLoad>("collision/Bullet", "", kContacts, kind, 0.01);
#endif
    add<PluginUnderLoad>("impact/Standard", "standard", kImpacts, kind, 0.01);
  }
  for (const char* kind : {"box-box", "hull-hull"}) {
    add<DistanceUnderLoad>("distance/Gravitas", "", kContacts, kind, -0.3);
#ifdef GRAVITAS_HAS_FCL
    add<FclUnderLoad>("distance/FCL", "", kContacts, kind, -0.3);
#endif
  }
  return true;
}();

}  // namespace
}  // namespace gravitas
