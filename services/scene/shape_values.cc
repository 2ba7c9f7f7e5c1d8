#include "services/scene/shape_values.h"

#include <algorithm>
#include <cmath>

#include "services/scene/assign.h"
#include "services/scene/obj_file.h"

namespace gravitas::scene {
namespace {

NamedValue* find(std::vector<NamedValue>* values, const char* name) {
  const auto found =
      std::find_if(values->begin(), values->end(), [&](const NamedValue& value) { return value.name == name; });
  return found == values->end() ? nullptr : &*found;
}

bool refuse(const TextPosition& position, std::string text, std::vector<PropertyProblem>* problems) {
  problems->push_back({position, std::move(text), false});
  return false;
}

// ---- faces

// Rows of indices of any length >= 3; false, with a problem, where one is none.
bool read_faces(const PropertyValue& given, std::vector<std::vector<std::uint32_t>>* faces,
                std::vector<PropertyProblem>* problems) {
  if (given.kind != PropertyValue::Kind::kList)
    return refuse(given.position, "Faces is " + shown(given) + "; allowed: a list of rows of indices", problems);
  for (const PropertyValue& row : given.list) {
    const std::string what = "face " + std::to_string(faces->size());
    if (row.kind != PropertyValue::Kind::kList || row.list.size() < 3)
      return refuse(row.position, what + " is " + shown(row) + "; allowed: a list of at least 3 indices of Vertices",
                    problems);
    std::vector<std::uint32_t>& face = faces->emplace_back();
    for (const PropertyValue& index : row.list) {
      const bool is_index = index.kind == PropertyValue::Kind::kNumber && index.number >= 0.0 &&
                            index.number < 4294967295.0 && index.number == std::floor(index.number);
      if (!is_index)
        return refuse(index.position, what + " has " + shown(index) + "; allowed: an index of Vertices", problems);
      face.push_back(static_cast<std::uint32_t>(index.number));
    }
  }
  return true;
}

PropertyValue triangles_of(const std::vector<std::vector<std::uint32_t>>& faces, const TextPosition& position) {
  PropertyValue all = PropertyValue::of(std::vector<PropertyValue>{});
  all.position = position;
  for (const std::vector<std::uint32_t>& face : faces) {
    for (std::size_t i = 1; i + 1 < face.size(); ++i) {
      const double row[] = {static_cast<double>(face[0]), static_cast<double>(face[i]),
                            static_cast<double>(face[i + 1])};
      all.list.push_back(PropertyValue::numbers(row));
    }
  }
  return all;
}

// The vertices, where they are such; what is wrong with them flatten() says.
std::vector<Vector3> vertices_of(const std::vector<NamedValue>& values) {
  std::vector<Vector3> vertices;
  for (const NamedValue& value : values) {
    if (value.name != "Vertices" || value.value.kind != PropertyValue::Kind::kList) continue;
    for (const PropertyValue& row : value.value.list) {
      if (row.kind != PropertyValue::Kind::kList || row.list.size() != 3) return {};
      vertices.emplace_back(row.list[0].number, row.list[1].number, row.list[2].number);
    }
  }
  return vertices;
}

bool expand_polyhedron(std::vector<NamedValue>* values, ShapeExpansion* expansion,
                       std::vector<PropertyProblem>* problems) {
  NamedValue* given = find(values, "Faces");
  if (given == nullptr) {
    if (const NamedValue* vertices = find(values, "Vertices")) expansion->position = vertices->value.position;
    return true;
  }
  expansion->position = given->value.position;
  std::vector<std::vector<std::uint32_t>> faces;
  if (!read_faces(given->value, &faces, problems)) return false;
  const std::vector<Vector3> vertices = vertices_of(*values);
  std::string why;
  if (!vertices.empty() && !faces.empty() && !make_convex_polyhedron(vertices, faces, &why))
    return refuse(given->value.position, why + "; allowed: the faces of a convex solid (or none: the hull of Vertices)",
                  problems);
  given->value = triangles_of(faces, given->value.position);
  return true;
}

bool expand_mesh(const std::string& folder, std::vector<NamedValue>* values, ShapeExpansion* expansion,
                 std::vector<PropertyProblem>* problems) {
  NamedValue* file = find(values, "File");
  NamedValue* given = find(values, "Faces");
  if (file == nullptr) {
    if (given == nullptr) return refuse({}, "Faces is missing; required: Vertices and Faces, or File", problems);
    if (find(values, "Vertices") == nullptr)
      return refuse({}, "Vertices is missing; required: Vertices and Faces, or File", problems);
    expansion->position = given->value.position;
    std::vector<std::vector<std::uint32_t>> faces;
    if (!read_faces(given->value, &faces, problems)) return false;
    given->value = triangles_of(faces, given->value.position);
    return true;
  }
  const TextPosition position = file->value.position;
  if (file->value.kind != PropertyValue::Kind::kText)
    return refuse(position, "File is " + shown(file->value) + "; allowed: the path of an OBJ file in double quotes",
                  problems);
  if (file->value.text.empty()) return refuse(position, "File is empty; allowed: the path of an OBJ file", problems);
  if (given != nullptr || find(values, "Vertices") != nullptr)
    return refuse(position, "File stands beside Vertices or Faces; allowed: one of both", problems);
  const std::string path = file->value.text.starts_with("/") ? file->value.text : folder + file->value.text;
  ObjMesh mesh;
  std::string why;
  if (!read_obj(path, &mesh, &why)) return refuse(position, path + why, problems);
  expansion->vertices = std::move(mesh.vertices);
  expansion->faces = std::move(mesh.triangles);
  expansion->prefix = path + ": ";
  expansion->position = position;
  values->erase(values->begin() + (file - values->data()));
  return true;
}

// ---- compounds

bool numbers_of(const PropertyValue& value, std::size_t count, std::vector<double>* out) {
  if (value.kind != PropertyValue::Kind::kList || value.list.size() != count) return false;
  for (const PropertyValue& element : value.list) {
    if (element.kind != PropertyValue::Kind::kNumber) return false;
    out->push_back(element.number);
  }
  return true;
}

bool expand_compound(SiblingShapes* siblings, std::vector<NamedValue>* values, ShapeExpansion* expansion,
                     std::vector<PropertyProblem>* problems) {
  NamedValue* given = find(values, "Children");
  if (given == nullptr || given->value.kind != PropertyValue::Kind::kList) return true;
  if (const NamedValue* parameters = find(values, "Parameters"))
    return refuse(parameters->position, "Parameters stands in a scene; allowed: Children alone", problems);
  expansion->position = given->value.position;
  SceneShape compound;
  compound.kind = SceneShape::Kind::kCompound;
  for (const PropertyValue& row : given->value.list) {
    const std::string what = "child " + std::to_string(compound.children.size());
    std::vector<double> numbers;
    const bool is_child =
        row.kind == PropertyValue::Kind::kList && (row.list.size() == 3 || row.list.size() == 4) &&
        row.list[0].kind == PropertyValue::Kind::kText && numbers_of(row.list[1], 3, &numbers) &&
        numbers_of(row.list[2], 4, &numbers) &&
        (row.list.size() == 3 || (row.list[3].kind == PropertyValue::Kind::kNumber && row.list[3].number > 0.0));
    if (!is_child)
      return refuse(row.position,
                    what + " is " + shown(row) +
                        "; allowed: {\"GeometryId\", {px, py, pz}, {qw, qx, qy, qz}} or the same with a density > 0",
                    problems);
    std::string id = row.list[0].text;
    if (const std::string warning = trim_reference("the GeometryId of " + what, &id); !warning.empty())
      problems->push_back({row.list[0].position, warning, true});
    SiblingShapes::Found found = siblings->find(id);
    if (!found.shape) return found.why.empty() ? false : refuse(row.list[0].position, what + ' ' + found.why, problems);
    if (found.shape->is_unbounded())
      return refuse(row.list[0].position, what + " is unbounded; allowed: bounded shapes", problems);
    SceneShape::Child& child = compound.children.emplace_back();
    child.shape = std::move(found.shape);
    child.pose.position = {numbers[0], numbers[1], numbers[2]};
    // the same words for a quaternion here as anywhere
    std::vector<double> unit;
    if (!flatten_value(Property::quaternion("the orientation of " + what, "geometry"), row.list[2], &unit, problems))
      return false;
    child.pose.orientation = Quaternion(unit[0], unit[1], unit[2], unit[3]);
    child.density = row.list.size() == 4 ? row.list[3].number : 0.0;
  }
  if (compound.children.empty())
    return refuse(given->value.position, "Children is empty; allowed: one or more", problems);
  // the flattened form, as tables of values
  const std::vector<double> flat = flattened_shape(compound);
  const auto table = [&](std::size_t begin, std::size_t columns) {
    std::vector<PropertyValue> rows;
    const auto count = static_cast<std::size_t>(flat[begin]);
    for (std::size_t i = 0; i < count; ++i)
      rows.push_back(PropertyValue::numbers(std::span(flat).subspan(begin + 1 + i * columns, columns)));
    return PropertyValue::of(std::move(rows));
  };
  constexpr std::size_t kChildColumns = 11;
  given->value = table(0, kChildColumns);
  values->push_back({"Parameters", table(1 + compound.children.size() * kChildColumns, 1), given->position});
  return true;
}

}  // namespace

bool expand_shape_values(const TypeDeclaration& type, const std::string& folder, SiblingShapes* siblings,
                         std::vector<NamedValue>* values, ShapeExpansion* expansion,
                         std::vector<PropertyProblem>* problems) {
  if (type.name == "ConvexPolyhedron") return expand_polyhedron(values, expansion, problems);
  if (type.name == "TriangleMesh") return expand_mesh(folder, values, expansion, problems);
  if (type.name == "Compound") return expand_compound(siblings, values, expansion, problems);
  return true;
}

void splice(const std::vector<Property>& declared, const ShapeExpansion& expansion, std::vector<double>* parameters) {
  if (expansion.vertices.empty()) return;
  std::vector<double> out;
  out.reserve(parameters->size() + expansion.vertices.size() + expansion.faces.size());
  std::size_t begin = 0;
  for (const Property& property : declared) {
    const std::size_t size = flat_size_of(property, std::span(*parameters).subspan(begin));
    const std::vector<double>* numbers = property.name == "Vertices" ? &expansion.vertices
                                         : property.name == "Faces"  ? &expansion.faces
                                                                     : nullptr;
    if (numbers != nullptr) {
      out.push_back(static_cast<double>(numbers->size() / 3));
      out.insert(out.end(), numbers->begin(), numbers->end());
    } else {
      const auto from = parameters->begin() + static_cast<std::ptrdiff_t>(begin);
      out.insert(out.end(), from, from + static_cast<std::ptrdiff_t>(size));
    }
    begin += size;
  }
  *parameters = std::move(out);
}

}  // namespace gravitas::scene
