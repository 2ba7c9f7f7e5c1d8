// Contacts over seams, of pairs alone: what a body rests on, and what is flush with that.
#include "workers/collision/standard/seams.h"

#include <gtest/gtest.h>

#include <numeric>
#include <utility>
#include <vector>

#include "tests/workers/collision/standard/shape_fixture.h"
#include "workers/collision/standard/narrow_phase.h"

namespace gravitas::collision::test {
namespace {

// A box with its bottom 2 mm below y = 0, its front 0.1 mm over a tile whose side is at x = 0.5, as a trial leaves it.
class OverASeam : public ::testing::Test {
 protected:
  Shapes shapes;
  const Shape& box = shapes.primitive(SceneShape::Kind::kBox, {0.1, 0.1, 0.1});
  const Shape& tile = shapes.primitive(SceneShape::Kind::kBox, {0.5, 0.5, 0.5});
  const Pose where = at(0.4001, 0.098, 0.0);
  // the floor before the seam
  const Rest floor{Vector3::UnitY(), Vector3::Zero(), 0.002};

  // Contacts of these pairs of these shapes, by what each body rests on.
  static void mend(const std::vector<Shape>& bodies, const std::vector<Pose>& poses,
                   const std::vector<std::uint32_t>& pairs, std::vector<ContactList>* lists) {
    std::vector<std::uint32_t> shape(bodies.size());
    std::iota(shape.begin(), shape.end(), 0U);
    std::vector<double> position(3 * bodies.size()), orientation(4 * bodies.size());
    const std::vector<double> same_position(3 * bodies.size());
    std::vector<double> same_orientation(4 * bodies.size());
    for (std::size_t i = 0; i < bodies.size(); ++i) {
      set_vector(position, i, poses[i].position);
      set_quaternion(orientation, i, poses[i].orientation);
      set_quaternion(same_orientation, i, Quaternion::Identity());
    }
    Seams().mend(bodies, {shape, same_position, same_orientation, position, orientation}, pairs, 0.001, *lists);
  }
  // With the body first or second, and the normal always away from the tile.
  ContactList contacts(const Shape& other, const Pose& X_WB, const Rest& rest, bool is_first) {
    const PairRests rests = is_first ? PairRests{{&rest, 1}, {}} : PairRests{{}, {&rest, 1}};
    ContactList list;
    if (is_first)
      collide(box, where, other, X_WB, 0.001, &list, &rests);
    else
      collide(other, X_WB, box, where, 0.001, &list, &rests);
    return list;
  }
};

TEST_F(OverASeam, TheShortestWayOutLeadsSideways) {
  const ContactList alone = all_contacts(box, where, tile, at(1.0, -0.5, 0.0));
  ASSERT_GT(alone.size(), 0U);
  EXPECT_NEAR(alone[0].normal.x(), 1.0, 1e-12);
  EXPECT_NEAR(alone.deepest(), 1e-4, 1e-12);
}

TEST_F(OverASeam, OfWhatIsFlushTheFloorsNormalIsTaken) {
  for (const bool is_first : {true, false}) {
    const ContactList list = contacts(tile, at(1.0, -0.5, 0.0), floor, is_first);
    ASSERT_EQ(list.size(), 4U);
    for (std::size_t i = 0; i < list.size(); ++i) {
      EXPECT_NEAR(list[i].normal.y(), is_first ? -1.0 : 1.0, 1e-12);
      EXPECT_NEAR(list[i].depth, 0.002, 1e-12);
      EXPECT_NEAR(list[i].point.y(), -0.001, 1e-12);
    }
  }
}

// So of a body of triangles, each of which is laid on the tile by itself.
TEST_F(OverASeam, AMeshIsLaidFlushToo) {
  const Shape& mesh = shapes.box_mesh({0.1, 0.1, 0.1});
  const PairRests of_first{{&floor, 1}, {}}, of_second{{}, {&floor, 1}};
  ContactList lists[2];
  collide(mesh, where, tile, at(1.0, -0.5, 0.0), 0.001, &lists[0], &of_first);
  collide(tile, at(1.0, -0.5, 0.0), mesh, where, 0.001, &lists[1], &of_second);
  for (const ContactList& list : lists) {
    ASSERT_EQ(list.size(), 4U);
    for (std::size_t i = 0; i < list.size(); ++i) {
      EXPECT_NEAR(list[i].normal.y(), &list == lists ? -1.0 : 1.0, 1e-12);
      EXPECT_NEAR(list[i].depth, 0.002, 1e-12);
      EXPECT_NEAR(list[i].point.y(), -0.001, 1e-12);
    }
  }
}

// Wherever both are: pairs that are computed the other way round had a plane to lie flush with that nobody had set.
TEST_F(OverASeam, WhereTheFloorIsDoesNotMatter) {
  const Shape& can = shapes.primitive(SceneShape::Kind::kCylinder, {0.1, 0.1, 0.1});
  for (const Shape* one : {&box, &can})
    for (const Pose& X : {at(0.0, 0.0, 0.0), at(3.0, 7.0, -2.0), at(-40.0, -30.0, 60.0)})
      for (const bool is_first : {true, false}) {
        const Pose body = compose(X, where), other = compose(X, at(1.0, -0.5, 0.0));
        const Rest rest{floor.normal, X.position + floor.point, floor.depth};
        const PairRests rests = is_first ? PairRests{{&rest, 1}, {}} : PairRests{{}, {&rest, 1}};
        ContactList list;
        if (is_first)
          collide(*one, body, tile, other, 0.001, &list, &rests);
        else
          collide(tile, other, *one, body, 0.001, &list, &rests);
        ASSERT_GT(list.size(), 0U) << X.position.x();
        for (std::size_t i = 0; i < list.size(); ++i) {
          EXPECT_NEAR(list[i].normal.y(), is_first ? -1.0 : 1.0, 1e-12);
          EXPECT_NEAR(list[i].depth, 0.002, 1e-12);
        }
      }
}

// A block of triangles: its side has no face along the floor's normal, and its top none along the side's.
TEST_F(OverASeam, ABlockOfTrianglesIsLaidFlushToo) {
  const Shape& block = shapes.box_mesh({0.5, 0.5, 0.5});
  for (const bool is_first : {true, false}) {
    const ContactList list = contacts(block, at(1.0, -0.5, 0.0), floor, is_first);
    ASSERT_GT(list.size(), 0U);
    for (std::size_t i = 0; i < list.size(); ++i) {
      EXPECT_NEAR(list[i].normal.y(), is_first ? -1.0 : 1.0, 1e-12);
      EXPECT_NEAR(list[i].depth, 0.002, 1e-12);
    }
    const ContactList raised = contacts(block, at(1.0, -0.4999, 0.0), floor, is_first);
    ASSERT_GT(raised.size(), 0U);
    EXPECT_NEAR(raised[0].normal.x(), is_first ? 1.0 : -1.0, 1e-12);
  }
}

// Bit for bit, whichever comes first.
TEST_F(OverASeam, TheMirrorLawHolds) {
  const ContactList one = contacts(tile, at(1.0, -0.5, 0.0), floor, true);
  const ContactList two = contacts(tile, at(1.0, -0.5, 0.0), floor, false);
  ASSERT_EQ(one.size(), two.size());
  for (std::size_t i = 0; i < one.size(); ++i) {
    EXPECT_EQ(one[i].point, two[i].point);
    EXPECT_EQ(one[i].depth, two[i].depth);
    EXPECT_EQ(one[i].feature, two[i].feature);
    EXPECT_EQ(one[i].normal, Vector3(-two[i].normal));
  }
}

TEST_F(OverASeam, WhatHasNotComeOverItMeetsNothing) {
  EXPECT_EQ(contacts(tile, at(1.0005, -0.5, 0.0), floor, true).size(), 0U);
}

TEST_F(OverASeam, LowerTilesAreNoObstacle) {
  const ContactList list = contacts(tile, at(1.0, -0.501, 0.0), floor, true);
  ASSERT_EQ(list.size(), 4U);
  EXPECT_NEAR(list[0].depth, 0.001, 1e-12);
  EXPECT_NEAR(list[0].normal.y(), -1.0, 1e-12);
}

TEST_F(OverASeam, WhatStandsAboveTheFloorIs) {
  const ContactList list = contacts(tile, at(1.0, -0.4999, 0.0), floor, true);
  ASSERT_GT(list.size(), 0U);
  EXPECT_NEAR(list[0].normal.x(), 1.0, 1e-12);
}

TEST_F(OverASeam, WhatSankDeeperThanIntoTheFloorIs) {
  const ContactList list = contacts(tile, at(1.0, -0.5, 0.0), {Vector3::UnitY(), Vector3::Zero(), 0.0005}, true);
  ASSERT_GT(list.size(), 0U);
  EXPECT_NEAR(list[0].normal.x(), 1.0, 1e-12);
}

TEST_F(OverASeam, ChildrenOfACompoundAreLookedAtOneByOne) {
  const Shape& floor_of_two = shapes.compound({{&tile, at(0.0, 0.0, 0.0)}, {&tile, at(1.0, 0.0, 0.0)}});
  const ContactList list = contacts(floor_of_two, at(0.0, -0.5, 0.0), floor, true);
  ASSERT_GT(list.size(), 0U);
  for (std::size_t i = 0; i < list.size(); ++i) EXPECT_NEAR(list[i].normal.y(), -1.0, 1e-12);
}

// Of one pair: the parts of a compound are looked at one by one, and each knows what the body has of the others. A ball and a can that
// lies have no face of their own to lay it along.
TEST_F(OverASeam, TheNextPartOfACompoundIsLaidFlushToo) {
  const Shape& block = shapes.box_mesh({0.5, 0.5, 0.5});
  const Shape& ball = shapes.primitive(SceneShape::Kind::kSphere, Vector3::Constant(0.1));
  const Shape& can = shapes.primitive(SceneShape::Kind::kCylinder, Vector3::Constant(0.1));
  const Pose lying = at(where.position, Vector3::UnitZ(), 0.5 * EIGEN_PI);
  for (const Shape* left : {&tile, &block})
    for (const Shape* right : {&tile, &block}) {
      const Shape& floor = shapes.compound({{left, at(0.0, -0.5, 0.0)}, {right, at(1.0, -0.5, 0.0)}});
      for (const auto& [body, X] : std::vector<std::pair<const Shape*, Pose>>{
               {&box, where}, {&ball, at(0.49, 0.098, 0.0)}, {&can, where}, {&can, lying}}) {
        for (const bool is_first : {true, false}) {
          std::vector<ContactList> lists(1);
          if (is_first)
            collide(*body, X, floor, Pose(), 0.001, &lists[0]);
          else
            collide(floor, Pose(), *body, X, 0.001, &lists[0]);
          mend({floor, *body}, {Pose(), X}, is_first ? std::vector{1U, 0U} : std::vector{0U, 1U}, &lists);
          ASSERT_GT(lists[0].size(), 0U);
          for (std::size_t i = 0; i < lists[0].size(); ++i)
            EXPECT_NEAR(lists[0][i].normal.y(), is_first ? -1.0 : 1.0, 1e-12);
        }
      }
    }
}

TEST_F(OverASeam, ABallThatHasNotPassedItFeelsTheFloorAlone) {
  const Shape& ball = shapes.primitive(SceneShape::Kind::kSphere, Vector3::Constant(0.1));
  const PairRests rests{{&floor, 1}, {}};
  ContactList list;
  collide(ball, at(0.49, 0.098, 0.0), tile, at(1.0, -0.5, 0.0), 0.001, &list);
  EXPECT_EQ(list.size(), 1U);
  collide(ball, at(0.49, 0.098, 0.0), tile, at(1.0, -0.5, 0.0), 0.001, &list, &rests);
  EXPECT_EQ(list.size(), 0U);
}

}  // namespace
}  // namespace gravitas::collision::test
