// Wavefront OBJ files, as far as a solid needs them: vertices and faces, polygons cut into triangles (by tinyobjloader).
#pragma once

#include <string>
#include <vector>

namespace gravitas::scene {

struct ObjMesh {
  std::vector<double> vertices;   // three each
  std::vector<double> triangles;  // three indices each, from 0
};

// False, and in *why what comes behind the name of the file (`:LINE: ` where there is one, what is wrong, what is allowed),
// where it cannot be read, is none, or has no face.
bool read_obj(const std::string& path, ObjMesh* mesh, std::string* why);

}  // namespace gravitas::scene
