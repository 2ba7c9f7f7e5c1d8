#include "plugin_sdk/shape_cache.h"

#include <gtest/gtest.h>

#include <initializer_list>
#include <stdexcept>
#include <string>

namespace gravitas {
namespace {

struct Asked {
  std::uint64_t hash;
  std::uint64_t type = 1;
};

class ShapeCacheTest : public testing::Test {
 protected:
  // The shapes of a request, and in made_ those that had to be made for it.
  std::string ask(std::initializer_list<Asked> shapes) {
    made_.clear();
    std::string answers;
    cache_.begin();
    for (const Asked& shape : shapes) {
      answers += cache_.get(shape.hash, shape.type, 3, [&] {
        if (shape.hash == 0) throw std::runtime_error("no shape");
        made_ += std::to_string(shape.hash) + ' ';
        return std::to_string(shape.hash) + '/' + std::to_string(shape.type) + ' ';
      });
    }
    cache_.end();
    return answers;
  }

  ShapeCache<std::string> cache_;
  std::string made_;
};

TEST_F(ShapeCacheTest, MakesAShapeOnceAndDropsWhatIsNotAskedFor) {
  EXPECT_EQ(ask({{1}, {2}, {3}}), "1/1 2/1 3/1 ");
  EXPECT_EQ(made_, "1 2 3 ");
  EXPECT_EQ(ask({{1}, {2}, {3}}), "1/1 2/1 3/1 ");
  EXPECT_EQ(made_, "");
  EXPECT_EQ(ask({{3}, {1}}), "3/1 1/1 ");
  EXPECT_EQ(made_, "");
  EXPECT_EQ(ask({{1}, {2}}), "1/1 2/1 ");
  EXPECT_EQ(made_, "2 ");
}

TEST_F(ShapeCacheTest, TellsTypesOfOneHashApart) {
  EXPECT_EQ(ask({{1, 1}, {1, 2}, {1, 1}}), "1/1 1/2 1/1 ");
  EXPECT_EQ(made_, "1 1 ");
}

TEST_F(ShapeCacheTest, AShorterRequestKeepsItsOwn) {
  ask({{1}, {2}});
  ask({{1}});
  EXPECT_EQ(made_, "");
  ask({{1}, {2}});
  EXPECT_EQ(made_, "2 ");
}

TEST_F(ShapeCacheTest, ARequestThatIsRefusedHarmsNoLaterOne) {
  ask({{1}, {2}});
  EXPECT_THROW(ask({{1}, {0}}), std::runtime_error);
  EXPECT_EQ(ask({{1}, {3}}), "1/1 3/1 ");
  EXPECT_EQ(made_, "3 ");
  EXPECT_EQ(ask({{1}, {2}}), "1/1 2/1 ");
}

}  // namespace
}  // namespace gravitas
