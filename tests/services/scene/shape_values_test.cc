// Shapes as a scene writes them: polygons, files, compounds, and every refusal with its place.
#include "services/scene/shape_values.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include "plugin_sdk/geometry/scene_shape.h"
#include "tests/services/scene/scene_fixture.h"

namespace gravitas::scene {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

// The catalogue of the other tests, its collision plugin declaring every shape of the language.
Catalog catalog() {
  std::vector<InstalledPlugin> plugins = declared_plugins();
  for (InstalledPlugin& plugin : plugins)
    if (plugin.declaration.slot == Slot::kCollision) plugin.declaration.types = scene_shape_types();
  return Catalog(std::move(plugins));
}

// A scene with these geometries, the first being that of a movable body.
BuiltScene built_of(const std::string& geometries, const std::string& id = "A") {
  return build("Geometries {\n" + geometries +
                   "\n}\nSimulator { }\nEnvironment { Space { Bodies { Body { Id = \"Thing\" GeometryId = \"" + id +
                   "\" MassDensity = 100 } } } }",
               {}, catalog());
}

const std::string kCube =
    "Vertices = {{-1,-1,-1},{1,-1,-1},{-1,1,-1},{1,1,-1},{-1,-1,1},{1,-1,1},{-1,1,1},{1,1,1}}\n"
    "Faces = {{0,4,6,2},{1,3,7,5},{0,1,5,4},{2,6,7,3},{0,2,3,1},{4,5,7,6}}";

std::string geometry(const std::string& type, const std::string& properties, const std::string& id = "A") {
  return "Geometry { Type = \"" + type + "\" Id = \"" + id + "\" CustomProperties {\n" + properties + "\n} }\n";
}

TEST(ShapeValues, PolygonsBecomeTrianglesAndMassIsThatOfTheSolid) {
  for (const char* type : {"ConvexPolyhedron", "TriangleMesh"}) {
    const BuiltScene scene = built_of(geometry(type, kCube));
    EXPECT_THAT(scene.errors(), IsEmpty());
    ASSERT_TRUE(scene.description.has_value());
    const kernel::BodyDescription& body = scene.description->bodies[0];
    EXPECT_NEAR(body.mass, 800.0, 1e-10);
    for (int i = 0; i < 3; ++i) EXPECT_NEAR(body.inertia[i], 800.0 * 2.0 / 3.0, 1e-10);
    EXPECT_EQ(body.bound.half_extents, Vector3(1, 1, 1));
  }
}

TEST(ShapeValues, WithoutFacesAPolyhedronIsTheHull) {
  const BuiltScene scene =
      built_of(geometry("ConvexPolyhedron", "Vertices = {{0,0,0},{1,0,0},{0,1,0},{0,0,1},{0.1,0.1,0.1}}"));
  EXPECT_THAT(scene.errors(), IsEmpty());
  ASSERT_TRUE(scene.description.has_value());
  EXPECT_NEAR(scene.description->bodies[0].mass, 100.0 / 6.0, 1e-12);
  // the faces were found here: workers get them
  const std::vector<double>& numbers = scene.description->shapes[0].parameters;
  EXPECT_EQ(numbers[0], 4.0);
  EXPECT_EQ(numbers[13], 4.0);
}

TEST(ShapeValues, BlanksAroundTheNameOfAChildAreDropped) {
  const BuiltScene scene = built_of(geometry("Compound", "Children = {{\" Block \",{-2,0,0},{1,0,0,0}}}") +
                                    geometry("Box", "HalfExtents = {1,1,1}", " Block"));
  EXPECT_THAT(scene.errors(), IsEmpty());
  EXPECT_TRUE(scene.description.has_value());
}

TEST(ShapeValues, CompoundsNameTheirChildrenInAnyOrder) {
  const BuiltScene scene =
      built_of(geometry("Compound", "Children = {{\"Block\",{-2,0,0},{1,0,0,0}},{\"Block\",{2,0,0},{1,0,0,0},300}}") +
               geometry("Box", "HalfExtents = {1,1,1}", "Block"));
  EXPECT_THAT(scene.errors(), IsEmpty());
  ASSERT_TRUE(scene.description.has_value());
  const kernel::BodyDescription& body = scene.description->bodies[0];
  EXPECT_NEAR(body.mass, 800.0 + 2400.0, 1e-9);
  // the scene's position is that of the geometry, the body's that of the centre of mass
  EXPECT_NEAR(body.pose.position.x(), 1.0, 1e-14);
  EXPECT_NEAR(body.bound.half_extents.maxCoeff(), 3.0, 1e-14);
}

TEST(ShapeValues, RefusalsNameThePlaceAndTheFace) {
  const auto error = [](const std::string& geometries) {
    const BuiltScene scene = built_of(geometries);
    const std::vector<std::string> errors = scene.errors();
    return errors.empty() ? std::string("no error") : errors[0];
  };
  std::string dented = kCube;
  dented.replace(dented.find("{1,1,1}"), 7, "{9,1,1}");
  EXPECT_THAT(error(geometry("ConvexPolyhedron", dented)), HasSubstr("4:9: error: ConvexPolyhedron \"A\": face"));
  std::string open = kCube;
  open.replace(open.find(",{4,5,7,6}"), 10, "");
  EXPECT_THAT(error(geometry("ConvexPolyhedron", open)), HasSubstr("has no neighbour at the edge"));
  EXPECT_THAT(error(geometry("ConvexPolyhedron", "Vertices = {{0,0,0},{1,0,0},{0,1,0},{1,1,0}}")),
              HasSubstr("in one plane"));
  std::string foreign = kCube;
  foreign.replace(foreign.find("{4,5,7,6}"), 9, "{4,5,8,6}");
  EXPECT_THAT(error(geometry("TriangleMesh", foreign)), HasSubstr("names vertex 8 of 8"));
  EXPECT_THAT(error(geometry("TriangleMesh", "Vertices = {{0,0,0}}")), HasSubstr("Faces is missing"));
  EXPECT_THAT(error(geometry("TriangleMesh", "Vertices = {{0,0,0}} Faces = {{0,1}}")),
              HasSubstr("face 0 is a list of 2; allowed"));
  EXPECT_THAT(error(geometry("TriangleMesh", "File = \"nowhere.obj\"")),
              HasSubstr("nowhere.obj: cannot be read: No such file or directory; allowed: an OBJ file"));
  EXPECT_THAT(error(geometry("TriangleMesh", "File = \"/tmp\"")), HasSubstr("/tmp: cannot be read: it is a folder"));
  EXPECT_THAT(error(geometry("TriangleMesh", "File = \"/dev/zero\"")),
              HasSubstr("3:8: error: TriangleMesh \"A\": /dev/zero: cannot be read: it is no file that ends"));
  EXPECT_THAT(error(geometry("TriangleMesh", "File = \"\"")),
              HasSubstr("3:8: error: TriangleMesh \"A\": File is empty; allowed: the path of an OBJ file"));
  EXPECT_THAT(error(geometry("Compound", "Children = {{\"Nobody\",{0,0,0},{1,0,0,0}}}")),
              HasSubstr("child 0 names no Geometry: \"Nobody\""));
  EXPECT_THAT(error(geometry("Compound", "Children = {{\"A\",{0,0,0},{1,0,0,0}}}")),
              HasSubstr("of which it is a part itself"));
  EXPECT_THAT(error(geometry("Compound", "Children = {{\"G\",{0,0,0},{1,0,0,0}}}") + geometry("Halfspace", "", "G")),
              HasSubstr("child 0 is unbounded"));
  EXPECT_THAT(
      error(geometry("Compound", "Children = {{\"B\",{0,0,0},{2,0,0,0}}}") + geometry("Sphere", "Radius = 1", "B")),
      HasSubstr("orientation of child 0 has the norm 2"));
  EXPECT_THAT(error(geometry("Compound", "Children = {}")), HasSubstr("Children is empty"));
  EXPECT_THAT(error(geometry("Cone", "Radius = 0 Height = 1")), HasSubstr("allowed: a number > 0"));
}

class ObjFile : public testing::Test {
 protected:
  ObjFile() { std::filesystem::create_directories(folder_); }
  ~ObjFile() override { std::filesystem::remove_all(folder_); }
  ObjFile(const ObjFile&) = delete;
  ObjFile& operator=(const ObjFile&) = delete;

  BuiltScene with(const std::string& text, const std::string& more = "") const {
    std::ofstream(folder_ / "x.obj") << text;
    return built_of(geometry("TriangleMesh", "File = \"" + (folder_ / "x.obj").string() + "\" " + more));
  }

  std::filesystem::path folder_ =
      std::filesystem::temp_directory_path() /
      ("gravitas_obj_" + std::string(testing::UnitTest::GetInstance()->current_test_info()->name()));
};

TEST_F(ObjFile, IsReadWithPolygonsAndScale) {
  const std::string cube =
      "# a cube\nmtllib none.mtl\no cube\nv -1 -1 -1\nv 1 -1 -1\nv -1 1 -1\nv 1 1 -1\nv -1 -1 1\nv 1 -1 1\nv -1 1 1\nv "
      "1 1 1\n"
      "vn 0 0 1\nf 1 5 7 3\nf 2/1 4/1 8/1 6/1\nf 1//1 2//1 6//1 5//1\nf 3 7 8 4\nf 1 3 4 2\nf -4 -3 -1 -2\n";
  const BuiltScene scene = with(cube, "Scale = 0.5");
  EXPECT_THAT(scene.errors(), IsEmpty());
  EXPECT_THAT(scene.warnings(), IsEmpty());
  ASSERT_TRUE(scene.description.has_value());
  EXPECT_NEAR(scene.description->bodies[0].mass, 100.0, 1e-11);
}

// 0.3 and 0.7 are the nearest doubles, as in a scene.
TEST_F(ObjFile, CoordinatesAreReadToTheLastBit) {
  const std::string faces = "f 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n";
  const BuiltScene file = with("v 0.3 0.7 +0.1\nv 1.3 0 0\nv 0 1.7 0\nv 0 0 1e-1\n" + faces);
  const BuiltScene text = built_of(
      geometry("TriangleMesh",
               "Vertices = {{0.3,0.7,0.1},{1.3,0,0},{0,1.7,0},{0,0,0.1}} Faces = {{0,2,1},{0,1,3},{0,3,2},{1,2,3}}"));
  ASSERT_TRUE(file.description.has_value() && text.description.has_value());
  EXPECT_EQ(file.description->shapes[0].parameters, text.description->shapes[0].parameters);
  EXPECT_THAT(with("v +-1 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\n" + faces).errors(),
              ElementsAre(HasSubstr("x.obj:1: a coordinate is \"+-1\"")));
}

TEST_F(ObjFile, TrianglesWithoutAreaAreCountedAndOpenOnesSaidToBeShells) {
  const BuiltScene scene =
      with("v 0 0 0\nv 1 0 0\nv 0 0 1\nv 1 0 1\nv 0.5 1 0.5\nf 1 5 2\nf 2 5 4\nf 4 5 3\nf 3 5 1\nf 1 1 2\nf 1 2 2\n");
  EXPECT_THAT(scene.errors(), IsEmpty());
  EXPECT_THAT(scene.warnings(),
              ElementsAre(HasSubstr("2 triangles without area were dropped"), HasSubstr("counts as a shell")));
}

TEST_F(ObjFile, RefusalsNameTheFile) {
  EXPECT_THAT(with("v 0 0 0\n").errors(), ElementsAre(HasSubstr("x.obj: has no face")));
}

// None of them is left out in silence.
TEST_F(ObjFile, LinesThatAreNoVertexOrFaceAreRefusedByTheirNumber) {
  const std::string good = "v 0 0 0\nv 1 0 0\r\nv 0 1 0\rv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\n";
  const std::string corner = "; allowed: a vertex from 1 to 4, or from -1 to -4 counted backwards";
  EXPECT_THAT(with(good + "f 2 3 4\n").errors(), IsEmpty());
  for (const auto& [line, problem] : std::vector<std::pair<std::string, std::string>>{
           {"f 2 3", "a face has 2 corners; allowed: three or more"},
           {"f", "a face has 0 corners; allowed: three or more"},
           {"f 1 2 9", "a corner is \"9\"" + corner},
           {"f 0 1 2", "a corner is \"0\"" + corner},
           {"f 1 2 -5", "a corner is \"-5\"" + corner},
           {"f 1 2 99999999999999999999", "a corner is \"99999999999999999999\"" + corner},
           {"f 1 2 3x", "a corner is \"3x\"" + corner},
           {"v 1 0", "a vertex has 2 coordinates; allowed: v and three finite numbers"},
           {"v a 0 0", "a coordinate is \"a\"; allowed: v and three finite numbers"},
           {"v 0 nan 0", "a coordinate is \"nan\"; allowed: v and three finite numbers"},
           {"v 0 0 1e999", "a coordinate is \"1e999\"; allowed: v and three finite numbers"}})
    EXPECT_THAT(with(good + line + "\n").errors(), ElementsAre(HasSubstr("x.obj:8: " + problem)));
}

TEST_F(ObjFile, AFaceMayComeBeforeItsVertices) {
  EXPECT_THAT(with("f 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\nv 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\n").errors(), IsEmpty());
}

}  // namespace
}  // namespace gravitas::scene
