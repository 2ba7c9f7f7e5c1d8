#include "services/scene/obj_file.h"

#include <fstream>

#define TINYOBJLOADER_USE_DOUBLE
#define TINYOBJLOADER_IMPLEMENTATION
#include <tiny_obj_loader.h>

namespace gravitas::scene {

bool read_obj(const std::string& path, ObjMesh* mesh, std::string* why) {
  std::ifstream file(path);
  if (!file) {
    *why = "cannot be opened";
    return false;
  }
  tinyobj::attrib_t attributes;
  std::vector<tinyobj::shape_t> shapes;
  std::vector<tinyobj::material_t> materials;
  std::string warning;
  why->clear();
  // without a reader of materials: they mean nothing here
  if (!tinyobj::LoadObj(&attributes, &shapes, &materials, &warning, why, &file, nullptr, true)) {
    while (!why->empty() && why->back() == '\n') why->pop_back();
    if (why->empty()) *why = "is no OBJ file";
    return false;
  }
  mesh->vertices.assign(attributes.vertices.begin(), attributes.vertices.end());
  for (const tinyobj::shape_t& shape : shapes)
    for (const tinyobj::index_t& index : shape.mesh.indices) mesh->triangles.push_back(index.vertex_index);
  if (!mesh->triangles.empty()) return true;
  *why = "has no face";
  return false;
}

}  // namespace gravitas::scene
