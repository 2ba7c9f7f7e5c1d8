// The memory of messages that is used again: what is read back is what was written, whoever still holds a piece.
#include <gtest/gtest.h>

#include <memory>
#include <vector>

#include "gravitas/stage/v1/call.pb.h"
#include "schemas/wire/byte_buffer.h"

namespace gravitas {
namespace {

const stage::MethodInfo& kMethod = stage::method_info(stage::Method::kSpacePairs);

// Numbers that say whose they are.
struct Numbers {
  explicit Numbers(double first, std::size_t count) : values(count, first) {}
  grpc::ByteBuffer written(wire::MessageRooms* rooms) const {
    const gravitas_column column{values.data(), values.size()};
    return rooms->write({kMethod.request.first(1), {&column, 1}, &header});
  }
  std::vector<double> values;
  stage::v1::Call header;
};

std::vector<double> read(const grpc::ByteBuffer& message) {
  wire::MessageRooms rooms;
  wire::ColumnsReader reader(kMethod.request.first(1));
  EXPECT_EQ(reader.parse(rooms.read(message)), "");
  std::vector<double> values(reader.count(0));
  reader.copy(0, values.data());
  return values;
}

// 24 to 240,000 bytes: in pieces of malloc's and in rooms of the stream's.
TEST(MessageRooms, AMessageIsReadAsItWasWritten) {
  wire::MessageRooms rooms;
  for (const std::size_t count : {3U, 30'000U, 300U, 24'000U, 30'000U}) {
    const Numbers one(static_cast<double>(count), count);
    EXPECT_EQ(read(one.written(&rooms)), one.values);
  }
}

// gRPC may hold a message while the next is written.
TEST(MessageRooms, WhatIsStillHeldIsNotWrittenOver) {
  wire::MessageRooms rooms;
  const Numbers one(1.0, 30'000), two(2.0, 30'000), three(3.0, 60'000);
  const grpc::ByteBuffer first = one.written(&rooms);
  const grpc::ByteBuffer second = two.written(&rooms), third = three.written(&rooms);
  EXPECT_EQ(read(first), one.values);
  EXPECT_EQ(read(second), two.values);
  EXPECT_EQ(read(third), three.values);
}

TEST(MessageRooms, AMessageOutlivesItsRooms) {
  auto rooms = std::make_unique<wire::MessageRooms>();
  const Numbers one(1.0, 30'000);
  const grpc::ByteBuffer message = one.written(rooms.get());
  rooms.reset();
  EXPECT_EQ(read(message), one.values);
}

// Memory is given back, and used again, once nobody holds it.
TEST(MessageRooms, AreUsedAgain) {
  wire::MessageRooms rooms;
  const auto place_of = [](const grpc::ByteBuffer& message) {
    std::vector<grpc::Slice> pieces;
    EXPECT_TRUE(message.Dump(&pieces).ok());
    EXPECT_EQ(pieces.size(), 1U);
    return pieces[0].begin();
  };
  const Numbers one(1.0, 30'000);
  const std::uint8_t* place = place_of(one.written(&rooms));
  for (int i = 0; i < 10; ++i) EXPECT_EQ(place_of(one.written(&rooms)), place);
}

}  // namespace
}  // namespace gravitas
