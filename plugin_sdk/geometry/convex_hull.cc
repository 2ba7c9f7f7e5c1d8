// convex_hull() of convex_polyhedron.h: qhull finds the facets, make_convex_polyhedron() checks and merges them.
//
// The points are moved to their first and scaled to unit extent before qhull sees them (its tolerances are absolute
// near zero); the polyhedron keeps the points as they were given.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <memory>

extern "C" {
#include <libqhull_r/libqhull_r.h>
#include <libqhull_r/poly_r.h>
}

#include "plugin_sdk/geometry/convex_polyhedron.h"

namespace gravitas {
namespace {

// A run of qhull, with what it allocates.
class Hull {
 public:
  // what qhull says of its troubles goes into memory, and with it away
  Hull() : qh_(std::make_unique<qhT>()), sink_(open_memstream(&text_, &text_size_)) { qh_zero(qh_.get(), sink_); }
  ~Hull() {
    qh_freeqhull(qh_.get(), qh_ALL);
    int current = 0, total = 0;
    qh_memfreeshort(qh_.get(), &current, &total);
    if (sink_ != nullptr) std::fclose(sink_);
    std::free(text_);  // NOLINT(cppcoreguidelines-no-malloc): open_memstream's
  }
  Hull(const Hull&) = delete;
  Hull& operator=(const Hull&) = delete;

  // False if qhull finds no solid.
  bool run(std::vector<double>* coordinates) {
    // Pp: no word about precision. The command is not changed, whatever its type says.
    std::string command = "qhull Pp";
    return qh_new_qhull(qh_.get(), 3, static_cast<int>(coordinates->size() / 3), coordinates->data(), 0, command.data(),
                        nullptr, sink_) == 0;
  }

  // Corners of every facet, counter-clockwise from outside.
  std::vector<std::vector<std::uint32_t>> facets() {
    std::vector<std::vector<std::uint32_t>> loops;
    for (facetT* facet = qh_->facet_list; facet != nullptr && facet->next != nullptr; facet = facet->next) {
      std::vector<std::uint32_t>& loop = loops.emplace_back();
      setT* corners = qh_facet3vertex(qh_.get(), facet);
      for (setelemT* element = corners->e; element->p != nullptr; ++element) {
        const auto* vertex = static_cast<const vertexT*>(element->p);
        loop.push_back(static_cast<std::uint32_t>(qh_pointid(qh_.get(), vertex->point)));
      }
      qh_settempfree(qh_.get(), &corners);
    }
    return loops;
  }

 private:
  char* text_ = nullptr;
  std::size_t text_size_ = 0;
  std::unique_ptr<qhT> qh_;
  std::FILE* sink_;
};

}  // namespace

std::optional<ConvexPolyhedron> convex_hull(std::span<const Vector3> points, std::string* why) {
  const auto refuse = [why](std::string text) {
    *why = std::move(text);
    return std::nullopt;
  };
  if (points.size() < 4) return refuse("fewer than 4 vertices");
  double extent = 0.0;
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (!points[i].allFinite()) return refuse("vertex " + std::to_string(i) + " is not finite");
    extent = std::max(extent, (points[i] - points[0]).cwiseAbs().maxCoeff());
  }
  if (!(extent > 0.0) || !std::isfinite(extent)) return refuse("the vertices have no extent");
  std::vector<double> coordinates;
  for (const Vector3& point : points) {
    const Vector3 scaled = (point - points[0]) / extent;
    coordinates.insert(coordinates.end(), {scaled.x(), scaled.y(), scaled.z()});
  }
  Hull hull;
  if (!hull.run(&coordinates)) return refuse("the vertices lie in one plane, or so nearly that they span no solid");
  std::vector<std::vector<std::uint32_t>> loops = hull.facets();
  // in an order that no version of qhull decides
  for (std::vector<std::uint32_t>& loop : loops)
    std::rotate(loop.begin(), std::min_element(loop.begin(), loop.end()), loop.end());
  std::sort(loops.begin(), loops.end());
  return make_convex_polyhedron(points, loops, why);
}

}  // namespace gravitas
