#include "services/survey/queries.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>

#include "plugin_sdk/checks.h"
#include "plugin_sdk/local_bound.h"
#include "plugin_sdk/ray_rule.h"
#include "services/survey/numbers.h"
#include "services/survey/question.h"

namespace gravitas::survey {
namespace {

using Pairs = std::vector<std::uint32_t>;

constexpr double kFarthestRay = 1e6;  // m, where nothing is said

bool overlap(const Bounds& a, const Bounds& b) {
  return (a.lower.array() <= b.upper.array()).all() && (b.lower.array() <= a.upper.array()).all();
}

// Rows of an answer that ascend, each once, below `count`.
AnswerProblem check_rows_of(const char* name, const std::vector<std::uint32_t>& rows, std::size_t count) {
  for (std::size_t i = 0; i < rows.size(); ++i)
    if (rows[i] >= count || (i > 0 && rows[i] <= rows[i - 1]))
      return {true, fmt::format("{} of row {} is {}: not asked, out of order or twice", name, i, rows[i])};
  return {};
}

AnswerProblem check_ray_candidates(const Pairs& candidate, std::size_t rays, std::size_t bodies) {
  for (std::size_t i = 0; i < candidate.size(); i += 2) {
    if (candidate[i] >= rays || candidate[i + 1] >= bodies)
      return {true, fmt::format("candidate of row {} names what does not exist", i / 2)};
    if (i > 0 && std::pair(candidate[i], candidate[i + 1]) <= std::pair(candidate[i - 2], candidate[i - 1]))
      return {true, fmt::format("candidate of row {} is out of order or twice", i / 2)};
  }
  return {};
}

// The hits that are wanted, `before(a, b)` telling which is nearer.
template <typename Hit, typename Before>
void choose(query::v1::Hits wanted, std::vector<Hit>* hits, Before&& before) {
  if (wanted != query::v1::HITS_ANY) std::ranges::stable_sort(*hits, before);
  if (wanted != query::v1::HITS_ALL && hits->size() > 1) hits->erase(hits->begin() + 1, hits->end());
}

class Answerer {
 public:
  Answerer(Surveyor* surveyor, const kernel::Environment& environment, const query::v1::Batch& batch)
      : surveyor_(*surveyor), environment_(environment), batch_(batch), reader_(*surveyor, environment, types()) {}

  query::v1::Answers answer() {
    // everything is read before anybody is asked
    read_rays();
    const auto casts = read(batch_.casts(), "casts");
    const auto overlaps = read(batch_.overlaps(), "overlaps");
    const auto closest = read(batch_.closest(), "closest");
    std::vector<Vector3> ways;
    for (int i = 0; i < batch_.casts_size(); ++i)
      ways.push_back(reader_.vector(batch_.casts(i).displacement(), fmt::format("casts[{}].displacement", i)));
    for (int i = 0; i < batch_.closest_size(); ++i)
      reader_.length(batch_.closest(i).distance(), fmt::format("closest[{}].distance", i));

    answers_.set_time(environment_.time());
    answers_.set_step(environment_.step_count());
    if (!rays_.empty()) answer_rays();
    if (!casts.empty()) answer_casts(casts, ways);
    if (!overlaps.empty()) answer_overlaps(overlaps);
    for (std::size_t i = 0; i < closest.size(); ++i)
      answer_closest(closest[i], batch_.closest(static_cast<int>(i)).distance());
    return std::move(answers_);
  }

 private:
  struct Ray {
    Vector3 origin, direction;
    double length;
    std::vector<std::uint8_t> counts;  // per body
  };
  // A shape that asks, and whom.
  struct Asked {
    Probe probe;
    std::vector<std::uint8_t> counts;
  };
  // The deepest contact of a shape with a body.
  struct Touch {
    std::uint32_t body;
    double depth;
    Vector3 point, normal;  // from the shape to the body
  };

  std::vector<TypeDeclaration> types() const {
    const AskedSlot& collision = surveyor_.slot(Slot::kCollision);
    return collision.is_empty() ? std::vector<TypeDeclaration>() : collision.description().plugins[0].declaration.types;
  }

  const std::string& id(std::uint32_t body) const { return environment_.model().body_id[body]; }
  std::uint32_t bodies() const { return environment_.model().body_count; }

  // ---- rays

  void read_rays() {
    for (int i = 0; i < batch_.rays_size(); ++i) {
      const query::v1::Ray& asked = batch_.rays(i);
      const std::string place = fmt::format("rays[{}]", i);
      Ray ray{reader_.vector(asked.origin(), place + ".origin"),
              reader_.vector(asked.direction(), place + ".direction"),
              reader_.length(asked.length(), place + ".length"), reader_.filter(asked.filter(), place + ".filter")};
      if (ray.length == 0.0) ray.length = kFarthestRay;
      const double largest = ray.direction.cwiseAbs().maxCoeff();
      if (largest == 0.0) throw BadQuestion(place + ".direction: it is zero; allowed: a vector of any other length");
      ray.direction = (ray.direction / largest).normalized();
      rays_.push_back(std::move(ray));
    }
  }

  void put_rays(MessageColumns* request) const {
    std::vector<double>&origin = request->f64("origin"), &direction = request->f64("direction");
    origin.resize(3 * rays_.size());
    direction.resize(origin.size());
    for (std::size_t i = 0; i < rays_.size(); ++i) {
      set_vector(origin, i, rays_[i].origin);
      set_vector(direction, i, rays_[i].direction);
      request->f64("length").push_back(rays_[i].length);
    }
  }

  bool may_ask_space() const {
    for (const kernel::LeftOut& left_out : environment_.plan().left_out)
      if (left_out.what == slot_name(Slot::kSpace)) return false;
    return surveyor_.slot(Slot::kSpace).has_capability("rays");
  }

  Pairs ray_candidates() {
    MessageColumns request =
        surveyor_.request(stage::Method::kSpaceRays, environment_, contact_margin(environment_.model().bound));
    put_rays(&request);
    Pairs candidates;
    if (may_ask_space()) {
      candidates = surveyor_
                       .ask(stage::Method::kSpaceRays, request,
                            [&](const MessageColumns& reply) {
                              return check_ray_candidates(reply.u32("candidate"), rays_.size(), bodies());
                            })
                       .u32("candidate");
    } else {
      const std::vector<gravitas_column> columns = request.plain();
      const RayRule meets{stage::SpaceRaysRequest(columns.data())};
      for (std::uint32_t ray = 0; ray < rays_.size(); ++ray)
        for (std::uint32_t body = 0; body < bodies(); ++body)
          if (meets(ray, body)) candidates.insert(candidates.end(), {ray, body});
    }
    Pairs counted;
    for (std::size_t i = 0; i < candidates.size(); i += 2)
      if (rays_[candidates[i]].counts[candidates[i + 1]] != 0)
        counted.insert(counted.end(), {candidates[i], candidates[i + 1]});
    return counted;
  }

  void answer_rays() {
    surveyor_.require(Slot::kCollision, "rays", "rays");
    struct Hit {
      std::uint32_t body;
      double distance;
      Vector3 normal;
    };
    std::vector<std::vector<Hit>> hits(rays_.size());
    const Pairs candidates = ray_candidates();
    if (!candidates.empty()) {
      MessageColumns request = surveyor_.request(stage::Method::kCollisionRays, environment_);
      put_rays(&request);
      request.u32("candidate") = candidates;
      const MessageColumns reply =
          surveyor_.ask(stage::Method::kCollisionRays, request, [&](const MessageColumns& answer) -> AnswerProblem {
            const std::vector<std::uint32_t>& rows = answer.u32("hit_candidate");
            if (AnswerProblem problem = check_rows_of("hit_candidate", rows, candidates.size() / 2);
                !problem.text.empty())
              return problem;
            for (std::size_t i = 0; i < rows.size(); ++i)
              if (const double distance = answer.f64("distance")[i];
                  !(distance >= 0.0 && distance <= rays_[candidates[2 * rows[i]]].length * (1.0 + 1e-9)))
                return {false, fmt::format("distance of row {} is {:g}: not on the ray", i, distance)};
            if (const std::size_t i = first_not_unit(answer.f64("normal"), 3); i != kNoRow)
              return {false, fmt::format("normal of row {} is no unit vector", i)};
            return {};
          });
      const std::vector<std::uint32_t>& rows = reply.u32("hit_candidate");
      for (std::size_t i = 0; i < rows.size(); ++i)
        hits[candidates[2 * rows[i]]].push_back(
            {candidates[2 * rows[i] + 1], reply.f64("distance")[i], vector_at(reply.f64("normal"), i)});
    }
    for (std::size_t ray = 0; ray < rays_.size(); ++ray) {
      choose(batch_.rays(static_cast<int>(ray)).hits(), &hits[ray],
             [](const Hit& a, const Hit& b) { return a.distance < b.distance; });
      query::v1::RayAnswer* answer = answers_.add_rays();
      for (const Hit& hit : hits[ray]) {
        query::v1::RayHit* out = answer->add_hits();
        out->set_body(id(hit.body));
        out->set_distance(hit.distance);
        write(rays_[ray].origin + hit.distance * rays_[ray].direction, out->mutable_point());
        write(hit.normal, out->mutable_normal());
      }
    }
  }

  // ---- shapes

  template <typename Question>
  std::vector<Asked> read(const google::protobuf::RepeatedPtrField<Question>& questions, const char* name) const {
    std::vector<Asked> all;
    for (int i = 0; i < questions.size(); ++i) {
      const std::string place = fmt::format("{}[{}]", name, i);
      Asked& asked = all.emplace_back(Asked{reader_.probe(questions[i].shape(), place + ".shape"),
                                            reader_.filter(questions[i].filter(), place + ".filter")});
      if (asked.probe.body != kNone) asked.counts[asked.probe.body] = 0;
    }
    return all;
  }

  // The bodies of the run and, behind them, one for each shape that asks.
  MessageColumns shapes_request(stage::Method method, const std::vector<Asked>& questions) const {
    MessageColumns request = surveyor_.request(method, environment_);
    const auto add = [&](const char* name, std::initializer_list<double> numbers) {
      request.f64(name).insert(request.f64(name).end(), numbers);
    };
    for (const Asked& asked : questions) {
      const Probe& probe = asked.probe;
      const Quaternion& q = probe.pose.orientation;
      const Vector3& p = probe.pose.position;
      request.u32("body_shape").push_back(static_cast<std::uint32_t>(request.u64("shape_hash").size()));
      request.u64("shape_hash").push_back(probe.hash);
      request.u64("shape_type").push_back(probe.type);
      request.f64("shape_parameter")
          .insert(request.f64("shape_parameter").end(), probe.parameters.begin(), probe.parameters.end());
      request.u32("shape_parameter_begin").push_back(static_cast<std::uint32_t>(request.f64("shape_parameter").size()));
      add("geometry_position", {0.0, 0.0, 0.0});
      add("geometry_orientation", {1.0, 0.0, 0.0, 0.0});
      add("position", {p.x(), p.y(), p.z()});
      add("orientation", {q.w(), q.x(), q.y(), q.z()});
    }
    return request;
  }

  // (body, shape that asks), by the shapes, where their bounds come within `reach` of each other.
  Pairs pairs_within(const std::vector<Asked>& questions, const std::vector<Vector3>& ways, double reach) const {
    Pairs pairs;
    for (std::size_t i = 0; i < questions.size(); ++i) {
      const Bounds own = widened(bounds_of(questions[i].probe, ways.empty() ? Vector3::Zero() : ways[i]),
                                 reach + contact_margin(environment_.model().bound));
      for (std::uint32_t body = 0; body < bodies(); ++body)
        if (questions[i].counts[body] != 0 && overlap(own, survey::bounds_of(environment_, body)))
          pairs.insert(pairs.end(), {body, bodies() + static_cast<std::uint32_t>(i)});
    }
    return pairs;
  }

  // Asks about each pair with bodies of its own: what a body touches besides counts as what it rests on.
  static void part(const Pairs& pairs, MessageColumns* request) {
    const auto repeat = [&](const char* name, std::size_t size, std::size_t row) {
      std::vector<double>& numbers = request->f64(name);
      for (std::size_t k = 0; k < size; ++k) {
        const double number = numbers[size * row + k];
        numbers.push_back(number);
      }
    };
    std::vector<std::uint32_t>& shapes = request->u32("body_shape");
    for (const std::uint32_t row : pairs) {
      request->u32("pair").push_back(static_cast<std::uint32_t>(shapes.size()));
      const std::uint32_t shape = shapes[row];
      shapes.push_back(shape);
      for (const char* vector : {"geometry_position", "position", "linear_velocity", "angular_velocity"})
        repeat(vector, 3, row);
      for (const char* quaternion : {"geometry_orientation", "orientation"}) repeat(quaternion, 4, row);
    }
  }

  // Per question, in the order of the bodies.
  std::vector<std::vector<Touch>> touches(const std::vector<Asked>& questions, double margin) {
    std::vector<std::vector<Touch>> found(questions.size());
    MessageColumns request = shapes_request(stage::Method::kCollisionManifolds, questions);
    for (const char* velocity : {"linear_velocity", "angular_velocity"})
      request.f64(velocity).resize(request.f64("position").size());
    request.f64("margin") = {margin};
    const Pairs pairs = pairs_within(questions, {}, margin);
    if (pairs.empty()) return found;
    part(pairs, &request);
    const MessageColumns reply = surveyor_.ask(stage::Method::kCollisionManifolds, request, contact_check(request));
    const std::vector<std::uint32_t>& rows = reply.u32("contact_pair");
    for (std::size_t i = 0; i < rows.size(); ++i) {
      const std::uint32_t body = pairs[2 * rows[i]];
      std::vector<Touch>& own = found[pairs[2 * rows[i] + 1] - bodies()];
      const Touch touch{body, reply.f64("depth")[i], vector_at(reply.f64("point"), i),
                        -vector_at(reply.f64("normal"), i)};
      if (own.empty() || own.back().body != body) {
        own.push_back(touch);
      } else if (touch.depth > own.back().depth) {
        own.back() = touch;
      }
    }
    return found;
  }

  void answer_overlaps(const std::vector<Asked>& questions) {
    for (const std::vector<Touch>& own : touches(questions, 0.0)) {
      query::v1::OverlapAnswer* answer = answers_.add_overlaps();
      for (const Touch& touch : own) {
        if (touch.depth < 0.0) continue;
        query::v1::OverlapHit* hit = answer->add_hits();
        hit->set_body(id(touch.body));
        hit->set_depth(touch.depth);
        write(touch.point, hit->mutable_point());
        write(touch.normal, hit->mutable_normal());
      }
    }
  }

  void answer_closest(const Asked& question, double distance) {
    std::vector<Touch> own = touches({question}, distance)[0];
    std::erase_if(own, [&](const Touch& touch) { return -touch.depth > distance; });
    std::ranges::stable_sort(own, {}, [](const Touch& touch) { return -touch.depth; });
    query::v1::ClosestAnswer* answer = answers_.add_closest();
    for (const Touch& touch : own) {
      const Vector3 half = 0.5 * touch.depth * touch.normal;
      query::v1::ClosestHit* hit = answer->add_hits();
      hit->set_body(id(touch.body));
      hit->set_distance(-touch.depth);
      write(touch.point + half, hit->mutable_point_on_shape());
      write(touch.point - half, hit->mutable_point_on_body());
    }
  }

  void answer_casts(const std::vector<Asked>& questions, const std::vector<Vector3>& ways) {
    surveyor_.require(Slot::kCollision, "times_of_impact", "shape casts");
    struct Impact {
      std::uint32_t body;
      double fraction, gap;
      Vector3 point, normal;
    };
    std::vector<std::vector<Impact>> found(questions.size());
    MessageColumns request = shapes_request(stage::Method::kCollisionTimesOfImpact, questions);
    request.f64("rotation").resize(request.f64("position").size());
    request.f64("displacement").resize(request.f64("position").size());
    for (std::size_t i = 0; i < ways.size(); ++i) set_vector(request.f64("displacement"), bodies() + i, ways[i]);
    const Pairs& pairs = request.u32("pair") = pairs_within(questions, ways, 0.0);
    if (!pairs.empty()) {
      const MessageColumns reply =
          surveyor_.ask(stage::Method::kCollisionTimesOfImpact, request, [&](const MessageColumns& answer) {
            return check_impact_rows(answer.u32("impact_pair"), answer.f64("fraction"), answer.f64("normal"),
                                     pairs.size() / 2);
          });
      const std::vector<std::uint32_t>& rows = reply.u32("impact_pair");
      for (std::size_t i = 0; i < rows.size(); ++i)
        found[pairs[2 * rows[i] + 1] - bodies()].push_back(
            {pairs[2 * rows[i]], reply.f64("fraction")[i], std::max(0.0, -reply.f64("depth")[i]),
             vector_at(reply.f64("point"), i), -vector_at(reply.f64("normal"), i)});
    }
    for (std::size_t i = 0; i < found.size(); ++i) {
      choose(batch_.casts(static_cast<int>(i)).hits(), &found[i],
             [](const Impact& a, const Impact& b) { return a.fraction < b.fraction; });
      query::v1::CastAnswer* answer = answers_.add_casts();
      for (const Impact& impact : found[i]) {
        query::v1::CastHit* hit = answer->add_hits();
        hit->set_body(id(impact.body));
        hit->set_fraction(impact.fraction);
        hit->set_gap(impact.gap);
        write(impact.point, hit->mutable_point());
        write(impact.normal, hit->mutable_normal());
      }
    }
  }

  Surveyor& surveyor_;
  const kernel::Environment& environment_;
  const query::v1::Batch& batch_;
  QuestionReader reader_;
  std::vector<Ray> rays_;
  query::v1::Answers answers_;
};

}  // namespace

query::v1::Answers answer(Surveyor* surveyor, const kernel::Environment& environment, const query::v1::Batch& batch) {
  return Answerer(surveyor, environment, batch).answer();
}

}  // namespace gravitas::survey
