// The loops that joints are written with.
#include "plugin_sdk/constraint.h"

#include <gtest/gtest.h>

#include <array>
#include <cstring>
#include <limits>
#include <string>
#include <vector>

#include "plugin_sdk/conformance/draw.h"
#include "plugin_sdk/math/rotation.h"

namespace gravitas {
namespace {

template <typename T>
gravitas_column column_of(const std::vector<T>& numbers) {
  return {numbers.data(), numbers.size()};
}

// Three joints on two bodies: 0-1, world-1, 1-world; with two, no and one property.
struct Joints {
  std::vector<std::uint64_t> type = {10, 20, 30};
  std::vector<std::uint32_t> body = {0, 1, kNone, 1, 1, kNone};
  std::vector<std::uint32_t> begin = {0, 2, 2, 3};
  std::vector<double> numbers = {0.5, 0.25, 8.0};
  std::vector<std::uint32_t> intact = {1, 1, 1}, kept = {0, 1, 0};
  std::vector<double> position = {1, 2, 3, 4, 5, 6};
  std::vector<double> orientation = {1, 0, 0, 0, 0, 1, 0, 0};
  std::vector<double> angular_velocity = {0, 0, 1, 0, 0, 2};
  std::vector<double> start_angular_velocity = {0, 3, 0, 0, 4, 0};
  std::vector<double> time = {1.5}, time_step = {0.01}, start_time = {1.25};
  std::vector<double> inverse_mass = {0.5, 0.0};

  template <typename Bind>
  void bind(Bind bind) {
    const std::array<gravitas_column, 7> request = {column_of(type),    column_of(body),     column_of(begin),
                                                    column_of(numbers), column_of(position), column_of(orientation),
                                                    column_of(kept)};
    std::array<gravitas_reply_column, 2> reply = {gravitas_reply_column{bound_begin.data(), bound_begin.size(), 0},
                                                  gravitas_reply_column{bound.data(), bound.size(), 0}};
    bind_each(stage::ConstraintBindRequest(request.data()), stage::ConstraintBindReply(reply.data()), bind);
    bound_begin.resize(reply[0].count);
    bound.resize(reply[1].count);
  }

  template <typename Describe>
  void describe(Describe describe) {
    using Request = stage::ConstraintDiscrepanciesRequest;
    using Reply = stage::ConstraintDiscrepanciesReply;
    std::array<gravitas_column, Request::kColumnCount> request{};
    request[Request::kConstraintType] = column_of(type);
    request[Request::kConstraintBody] = column_of(body);
    request[Request::kBoundBegin] = column_of(begin);
    request[Request::kBound] = column_of(numbers);
    request[Request::kIntact] = column_of(intact);
    request[Request::kPosition] = column_of(position);
    request[Request::kOrientation] = column_of(orientation);
    request[Request::kAngularVelocity] = column_of(angular_velocity);
    request[Request::kStartAngularVelocity] = column_of(start_angular_velocity);
    request[Request::kTime] = column_of(time);
    request[Request::kTimeStep] = column_of(time_step);
    request[Request::kStartTime] = column_of(start_time);
    request[Request::kInverseMass] = column_of(inverse_mass);
    std::array<gravitas_reply_column, Reply::kColumnCount> reply{};
    std::vector<std::array<double, 64>> room(Reply::kColumnCount);
    for (std::size_t i = 0; i < room.size(); ++i) reply[i] = {room[i].data(), 64, 0};
    describe_each(Request(request.data()), Reply(reply.data()), describe);
    described.resize(reply[Reply::kConstraint].count);
    std::memcpy(described.data(), room[Reply::kConstraint].data(), described.size() * sizeof(std::uint32_t));
  }

  std::vector<std::uint32_t> bound_begin = std::vector<std::uint32_t>(8);
  std::vector<double> bound = std::vector<double>(32);
  std::vector<std::uint32_t> described;
};

TEST(BindEach, GivesEachJointItsTypePropertiesAndBodies) {
  Joints joints;
  std::vector<std::uint64_t> types;
  std::vector<double> read;
  std::vector<Vector3> first, second;
  joints.bind([&](std::uint64_t type, PropertyCursor properties, const JointBodies& bodies, BoundWriter& out) {
    types.push_back(type);
    while (!properties.at_end()) read.push_back(properties.number());
    first.push_back(bodies.pose1.position);
    second.push_back(bodies.pose2.position);
    EXPECT_EQ(bodies.is_kept, type == 20);
    if (type == 10) out.vector(Vector3(1, 2, 3));
    if (type == 30) out.number(4);
  });
  EXPECT_EQ(types, joints.type);
  EXPECT_EQ(read, joints.numbers);
  // the world stands at the origin
  const Vector3 a(1, 2, 3), b(4, 5, 6), world = Vector3::Zero();
  EXPECT_EQ(first, (std::vector<Vector3>{a, world, b}));
  EXPECT_EQ(second, (std::vector<Vector3>{b, b, world}));
  EXPECT_EQ(joints.bound_begin, (std::vector<std::uint32_t>{0, 3, 3, 4}));
  EXPECT_EQ(joints.bound, (std::vector<double>{1, 2, 3, 4}));
}

TEST(BindEach, OfNoJointsHasOneBeginning) {
  Joints joints;
  joints.type.clear(), joints.body.clear(), joints.numbers.clear(), joints.begin = {0};
  joints.bind([](std::uint64_t, PropertyCursor, const JointBodies&, BoundWriter&) { FAIL(); });
  EXPECT_EQ(joints.bound_begin, std::vector<std::uint32_t>{0});
  EXPECT_TRUE(joints.bound.empty());
}

TEST(DescribeEach, TellsWhichJointADiscrepancyIsOf) {
  Joints joints;
  joints.describe([](std::uint64_t type, PropertyCursor, const JointBodies&, auto&& emit) {
    for (std::uint64_t i = 0; i < type / 10; ++i) emit(Discrepancy{});
  });
  EXPECT_EQ(joints.described, (std::vector<std::uint32_t>{0, 1, 1, 2, 2, 2}));
}

TEST(DescribeEach, TellsHowBodiesTurnAndForHowLong) {
  Joints joints;
  std::vector<Vector3> first, second, start;
  std::vector<double> inverse_masses;
  joints.describe([&](std::uint64_t, PropertyCursor, const JointBodies& bodies, auto&&) {
    first.push_back(bodies.spin1), second.push_back(bodies.spin2), start.push_back(bodies.start_spin1);
    inverse_masses.push_back(bodies.inverse_mass1);
    EXPECT_EQ(bodies.time_step, 0.01);
    EXPECT_EQ(bodies.time, 1.5);
    EXPECT_EQ(bodies.elapsed, 0.25);
  });
  const Vector3 a(0, 0, 1), b(0, 0, 2), world = Vector3::Zero();
  EXPECT_EQ(first, (std::vector<Vector3>{a, world, b}));
  EXPECT_EQ(second, (std::vector<Vector3>{b, b, world}));
  EXPECT_EQ(start, (std::vector<Vector3>{{0, 3, 0}, world, {0, 4, 0}}));
  EXPECT_EQ(inverse_masses, (std::vector<double>{0.5, 0.0, 0.0}));
}

TEST(DescribeEach, LeavesBrokenJointsOut) {
  Joints joints;
  joints.intact[1] = 0;
  std::vector<std::uint64_t> types;
  joints.describe([&](std::uint64_t type, PropertyCursor, const JointBodies&, auto&& emit) {
    types.push_back(type);
    emit(Discrepancy{});
  });
  EXPECT_EQ(types, (std::vector<std::uint64_t>{10, 30}));
  EXPECT_EQ(joints.described, (std::vector<std::uint32_t>{0, 2}));
}

// Why the loops refuse what the test made of the joints.
template <typename Spoil>
std::string refusal(Spoil spoil) {
  Joints joints;
  spoil(&joints);
  std::string bound, described;
  try {
    joints.bind([](std::uint64_t, PropertyCursor, const JointBodies&, BoundWriter&) {});
  } catch (const Refusal& error) {
    bound = error.what();
  }
  try {
    joints.describe([](std::uint64_t, PropertyCursor, const JointBodies&, auto&&) {});
  } catch (const Refusal& error) {
    described = error.what();
  }
  EXPECT_EQ(bound, described);
  return bound;
}

TEST(JointLoops, RefuseBodiesThatDoNotExist) {
  EXPECT_EQ(refusal([](Joints* joints) { joints->body[1] = 2; }), "joint 0: it names body 2, which does not exist");
  EXPECT_EQ(refusal([](Joints* joints) { joints->body[3] = kNone - 1; }),
            "joint 1: it names body 4294967294, which does not exist");
}

TEST(JointLoops, RefuseParametersOutsideTheirColumn) {
  EXPECT_EQ(refusal([](Joints* joints) { joints->begin[3] = 4; }), "joint 2: its parameters lie outside their column");
  EXPECT_EQ(refusal([](Joints* joints) { joints->begin[1] = 3; }), "joint 1: its parameters lie outside their column");
  EXPECT_EQ(refusal([](Joints* joints) { joints->begin.pop_back(); }),
            "joint 2: its parameters lie outside their column");
}

// An author's text need not say which joint it is about; nor need a cursor that is read too far.
TEST(JointLoops, NameTheJointThatIsRefused) {
  const auto refused = [](auto act) -> std::string {
    try {
      act();
    } catch (const Refusal& error) {
      return error.what();
    }
    return "nothing was refused";
  };
  Joints joints;
  EXPECT_EQ(refused([&] {
              joints.bind([](std::uint64_t type, PropertyCursor, const JointBodies&, BoundWriter&) {
                if (type == 30) throw Refusal("Axis is missing");
              });
            }),
            "joint 2: Axis is missing");
  EXPECT_EQ(refused([&] {
              joints.describe([](std::uint64_t type, PropertyCursor, const JointBodies&, auto&&) {
                if (type == 20) throw Refusal("Axis is missing");
              });
            }),
            "joint 1: Axis is missing");
  const std::string beyond = refused([&] {
    joints.bind([](std::uint64_t type, PropertyCursor properties, const JointBodies&, BoundWriter&) {
      if (type == 20) properties.number();
    });
  });
  EXPECT_EQ(beyond.substr(0, 9), "joint 1: ");
}

TEST(JointLoops, RefuseNumbersThatAreNotFinite) {
  Joints joints;
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THROW(
      joints.bind([&](std::uint64_t, PropertyCursor, const JointBodies&, BoundWriter& out) { out.number(nan); }),
      Refusal);
  EXPECT_THROW(joints.describe([&](std::uint64_t, PropertyCursor, const JointBodies&, auto&& emit) {
    Discrepancy d;
    d.velocity.z() = nan;
    emit(d);
  }),
               Refusal);
}

TEST(PointDiscrepancy, HoldsTwoAnchorsTogether) {
  conformance::Draw random(1);
  const JointBodies bodies{random.pose(3.0), random.pose(3.0)};
  const Vector3 anchor1 = random.vector(1.0), anchor2 = random.vector(1.0);
  const Discrepancy d = point_discrepancy(anchor1, anchor2, bodies);
  EXPECT_EQ(d.point1, transform_point(bodies.pose1, anchor1));
  EXPECT_EQ(d.point2, transform_point(bodies.pose2, anchor2));
  EXPECT_EQ(d.modes, pack_modes(AxisMode::kLocked, AxisMode::kLocked, AxisMode::kLocked));
  EXPECT_TRUE(d.velocity.isZero(0.0) && d.compliance.isZero(0.0));
  EXPECT_EQ(d.correction, 1.0);
  EXPECT_EQ(d.maximum_force, Vector3::Constant(kUnlimited));
}

}  // namespace
}  // namespace gravitas
