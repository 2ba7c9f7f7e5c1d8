// The wire: the codec of schemas/wire against protobuf itself, the golden messages, and bytes that are no message.
//
// The golden messages are written by hand, as text, in schemas/golden/*.txt; their bytes stand beside them in *.hex.
// Renew the bytes after a change of a text with
//
//   GRAVITAS_WRITE_GOLDEN=1 build/release/bin/test_schemas --gtest_filter=Golden*
#include <gmock/gmock.h>
#include <google/protobuf/compiler/importer.h>
#include <google/protobuf/dynamic_message.h>
#include <google/protobuf/io/coded_stream.h>
#include <google/protobuf/io/zero_copy_stream_impl_lite.h>
#include <google/protobuf/text_format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cinttypes>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <limits>
#include <memory>
#include <random>
#include <set>
#include <span>
#include <sstream>
#include <string>
#include <vector>

#include "plugin_sdk/message_columns.h"
#include "schemas/stage_frames.h"
#include "schemas/wire/columns.h"
#include "tests/paths.h"

namespace gravitas {
namespace {

namespace fs = std::filesystem;
namespace pb = google::protobuf;
using stage::ColumnInfo;
using stage::ElementType;
using Infos = std::span<const ColumnInfo>;

const fs::path kGolden = in_source("/schemas/golden");

// ---- protobuf's own view of the schemas

class NoErrors : public pb::compiler::MultiFileErrorCollector {
 public:
  void AddError(const std::string& file, int line, int, const std::string& text) override {
    ADD_FAILURE() << file << ':' << line + 1 << ": " << text;
  }
};

// Message types of the .proto files, without generated classes.
class Schemas {
 public:
  Schemas() {
    tree_.MapPath("", in_source("/schemas"));
    tree_.MapPath("", "/usr/include");
    for (const char* file : {"stage/v1/space", "stage/v1/collision", "stage/v1/constraint", "stage/v1/force",
                             "stage/v1/integrator", "stage/v1/solver", "control/v1/control"})
      importer_.Import(std::string("gravitas/") + file + ".proto");
  }

  const pb::Descriptor* type(const std::string& name) const { return importer_.pool()->FindMessageTypeByName(name); }
  const pb::MethodDescriptor* method(const char* path) const {
    std::string name = path + 1;
    std::ranges::replace(name, '/', '.');
    return importer_.pool()->FindMethodByName(name);
  }
  std::unique_ptr<pb::Message> message(const pb::Descriptor* type) {
    return std::unique_ptr<pb::Message>(factory_.GetPrototype(type)->New());
  }

 private:
  pb::compiler::DiskSourceTree tree_;
  NoErrors errors_;
  pb::compiler::Importer importer_{&tree_, &errors_};
  pb::DynamicMessageFactory factory_;
};

Schemas& schemas() {
  static Schemas all;
  return all;
}

std::string serialized(const pb::Message& message) {
  std::string bytes;
  {
    pb::io::StringOutputStream stream(&bytes);
    pb::io::CodedOutputStream coded(&stream);
    coded.SetSerializationDeterministic(true);
    EXPECT_TRUE(message.SerializeToCodedStream(&coded));
  }
  return bytes;
}

std::span<const std::byte> bytes_of(const std::string& text) { return std::as_bytes(std::span(text)); }

// ---- the codec's view

struct MessageType {
  Infos infos;
  const pb::Descriptor* descriptor;
};

std::vector<MessageType> all_message_types() {
  std::vector<MessageType> types;
  for (const stage::MethodInfo& method : stage::kMethods) {
    types.push_back({method.request, schemas().method(method.path)->input_type()});
    types.push_back({method.reply, schemas().method(method.path)->output_type()});
  }
  return types;
}

std::string written(Infos infos, std::span<const gravitas_column> columns) {
  std::string bytes(wire::columns_size(infos, columns), '\0');
  auto* begin = reinterpret_cast<std::uint8_t*>(bytes.data());
  EXPECT_EQ(wire::write_columns(infos, columns, begin), begin + bytes.size()) << "columns_size() is wrong";
  return bytes;
}

std::string with_submessage(std::string bytes, wire::Field field, std::span<const std::byte> content) {
  std::string head(wire::submessage_head_size(field, content.size()), '\0');
  wire::write_submessage_head(field, content.size(), reinterpret_cast<std::uint8_t*>(head.data()));
  return bytes + head + std::string(reinterpret_cast<const char*>(content.data()), content.size());
}

// The columns of a message that was parsed, as values.
MessageColumns columns_read(Infos infos, const wire::ColumnsReader& reader) {
  MessageColumns columns(infos);
  for (std::size_t i = 0; i < infos.size(); ++i) {
    const auto read = [&]<typename T>(std::vector<T>& numbers) {
      numbers.assign(reader.count(i), T{});
      reader.copy(i, numbers.data());
    };
    if (infos[i].type == ElementType::kF64) read(columns.f64(infos[i].name));
    if (infos[i].type == ElementType::kU32) read(columns.u32(infos[i].name));
    if (infos[i].type == ElementType::kU64) read(columns.u64(infos[i].name));
  }
  return columns;
}

// ---- random columns, whose numbers have every length as varints

using Random = std::mt19937_64;

std::uint64_t random_bits(Random* random) { return (*random)() >> ((*random)() % 64); }

constexpr double kInfinity = std::numeric_limits<double>::infinity();

double random_double(Random* random) {
  constexpr double kSpecial[] = {0.0, -0.0, 1.0, 1e300, 5e-324, -kInfinity};
  return (*random)() % 4 == 0 ? kSpecial[(*random)() % std::size(kSpecial)]
                              : std::ldexp(double((*random)() >> 11), -40);
}

MessageColumns random_columns(Infos infos, Random* random) {
  MessageColumns columns(infos);
  for (const ColumnInfo& info : infos) {
    const bool is_value = info.rows_index == stage::kScalar;
    const std::size_t count = is_value ? 1 : (*random)() % 4 * info.components;
    const auto fill = [&]<typename T>(std::vector<T>& numbers, auto draw) {
      numbers.resize(count);
      std::ranges::generate(numbers, [&] { return static_cast<T>(draw()); });
    };
    if (info.type == ElementType::kF64) fill(columns.f64(info.name), [&] { return random_double(random); });
    if (info.type == ElementType::kU32) fill(columns.u32(info.name), [&] { return random_bits(random) & 0xFFFFFFFF; });
    if (info.type == ElementType::kU64) fill(columns.u64(info.name), [&] { return random_bits(random); });
  }
  return columns;
}

// The same columns in protobuf's message.
void fill(const MessageType& type, const MessageColumns& columns, pb::Message* message) {
  const pb::Reflection& reflection = *message->GetReflection();
  for (std::size_t i = 0; i < type.infos.size(); ++i) {
    const ColumnInfo& info = type.infos[i];
    const pb::FieldDescriptor* field = type.descriptor->FindFieldByNumber(static_cast<int>(i) + 1);
    ASSERT_NE(field, nullptr);
    ASSERT_EQ(field->name(), info.name);
    const auto set = [&](const auto& numbers, auto single, auto add) {
      for (const auto number : numbers) {
        if (field->is_repeated()) {
          (reflection.*add)(message, field, number);
        } else {
          (reflection.*single)(message, field, number);
        }
      }
    };
    if (info.type == ElementType::kF64)
      set(columns.f64(info.name), &pb::Reflection::SetDouble, &pb::Reflection::AddDouble);
    if (info.type == ElementType::kU32)
      set(columns.u32(info.name), &pb::Reflection::SetUInt32, &pb::Reflection::AddUInt32);
    if (info.type == ElementType::kU64)
      set(columns.u64(info.name), &pb::Reflection::SetUInt64, &pb::Reflection::AddUInt64);
  }
}

TEST(Wire, WritesWhatProtobufWritesAndReadsItBack) {
  Random random(1);
  for (const MessageType& type : all_message_types()) {
    for (int trial = 0; trial < 50; ++trial) {
      SCOPED_TRACE(type.descriptor->name() + ", trial " + std::to_string(trial));
      const MessageColumns columns = random_columns(type.infos, &random);
      const std::string bytes = written(type.infos, columns.plain());
      const std::unique_ptr<pb::Message> message = schemas().message(type.descriptor);
      fill(type, columns, message.get());
      ASSERT_EQ(bytes, serialized(*message));

      wire::ColumnsReader reader(type.infos);
      ASSERT_EQ(reader.parse(bytes_of(bytes)), "");
      ASSERT_EQ(columns_read(type.infos, reader).bytes(), columns.bytes());
      EXPECT_FALSE(reader.header().has || reader.derivative().has || reader.asset().has);
    }
  }
}

// The elements of a column one by one with a tag each, or packed in two parts, and the fields in disorder, with
// fields in between that nobody knows.
TEST(Wire, ReadsEveryEncodingThatProtobufReads) {
  Random random(2);
  for (const MessageType& type : all_message_types()) {
    for (int trial = 0; trial < 50; ++trial) {
      SCOPED_TRACE(type.descriptor->name() + ", trial " + std::to_string(trial));
      const MessageColumns columns = random_columns(type.infos, &random);
      const std::vector<gravitas_column> plain = columns.plain();
      std::vector<std::size_t> order(type.infos.size());
      for (std::size_t i = 0; i < order.size(); ++i) order[i] = i;
      std::ranges::shuffle(order, random);

      std::string bytes;
      for (const std::size_t i : order) {
        const std::size_t size = stage::element_size(type.infos[i].type);
        const std::uint64_t count = plain[i].count, split = count == 0 ? 0 : random() % count;
        const bool is_single = type.infos[i].rows_index == stage::kScalar || random() % 2 == 0;
        std::vector<gravitas_column> part(type.infos.size(), gravitas_column{nullptr, 0});
        // a column of the same type that is a single value writes one element without packing it
        const auto one_by_one = [&] {
          for (std::uint64_t k = 0; k < count; ++k) {
            std::vector<ColumnInfo> singles(type.infos.begin(), type.infos.end());
            singles[i].rows_index = stage::kScalar;
            part[i] = {static_cast<const std::byte*>(plain[i].data) + k * size, 1};
            const std::string element = written(singles, part);
            // left out where it is zero, which only a single value may be
            if (element.empty() && type.infos[i].rows_index != stage::kScalar) bytes += written(type.infos, part);
            bytes += element;
          }
        };
        const auto in_parts = [&] {
          part[i] = {plain[i].data, split};
          bytes += written(type.infos, part);
          part[i] = {static_cast<const std::byte*>(plain[i].data) + split * size, count - split};
          bytes += written(type.infos, part);
        };
        is_single ? one_by_one() : in_parts();
        // field 77: a varint; 78: eight bytes; 79: a text; 80: four bytes; 81: a group
        bytes += std::string("\xE8\x04\x96\x01", 4) +
                 std::string(
                     "\xF1\x04"
                     "12345678",
                     10) +
                 std::string(
                     "\xFA\x04\x03"
                     "abc",
                     6) +
                 std::string(
                     "\x85\x05"
                     "1234",
                     6) +
                 std::string("\x8B\x05\x08\x01\x8C\x05", 6);
      }
      const std::unique_ptr<pb::Message> message = schemas().message(type.descriptor);
      ASSERT_TRUE(message->ParseFromString(bytes));
      message->DiscardUnknownFields();
      ASSERT_EQ(serialized(*message), written(type.infos, plain)) << "the test writes what it means";

      wire::ColumnsReader reader(type.infos);
      ASSERT_EQ(reader.parse(bytes_of(bytes)), "");
      ASSERT_EQ(columns_read(type.infos, reader).bytes(), columns.bytes());
    }
  }
}

struct Refused {
  const char* name;
  std::string bytes;  // of a ForceWrenchesRequest
  const char* why;
};

// Field 1 is a double, 2 uint64, 3 uint32.
TEST(Wire, RefusesWhatIsNoMessageAndSaysWhy) {
  const Refused all[] = {
      {"no end", "\xFF", "the message is broken off"},
      {"a list for a value", std::string("\x0A\x08", 2) + std::string(8, '\0'), "column time is a list"},
      {"half a double", std::string("\x22\x04", 2) + std::string(4, '\0'),
       "column force_parameter ends within an element"},
      {"a length beyond the end", "\x22\x7F", "column force_parameter is broken off"},
      {"33 bits", "\x1A\x05\xFF\xFF\xFF\xFF\x1F", "column force_parameter_begin has an element of more than 32 bits"},
      {"65 bits", "\x12\x0A\xFF\xFF\xFF\xFF\xFF\xFF\xFF\xFF\xFF\x02",
       "column force_type has an element of more than 64 bits"},
      {"a varint without end", "\x12\x02\x80\x80", "column force_type ends within an element"},
      {"a double as a varint", std::string("\x20\x01", 2), "column force_parameter has another type"},
      {"a header as a number", std::string("\xA8\x06\x01", 3), "field 101 has another type"}};
  for (const Refused& one : all) {
    wire::ColumnsReader reader(stage::method_info(stage::Method::kForceWrenches).request);
    EXPECT_THAT(reader.parse(bytes_of(one.bytes)), testing::HasSubstr(one.why)) << one.name;
  }
}

// What a worker in another language asks the compiler for is what the kernel compares.
TEST(Wire, TheSchemaHashIsPrintedAsTheKernelHasIt) {
  const std::string command =
      in_shell(in_build("/bin/frame_compiler")) + " --proto-root " + in_shell(in_source("/schemas")) + " --hash";
  FILE* pipe = popen(command.c_str(), "r");
  ASSERT_NE(pipe, nullptr);
  std::uint64_t printed = 0;
  EXPECT_EQ(fscanf(pipe, "0x%" SCNx64, &printed), 1);
  EXPECT_EQ(pclose(pipe), 0);
  EXPECT_EQ(printed, stage::kSchemaHash);
}

// ---- golden messages

struct Golden {
  std::string name, type, text;
  fs::path hex;
};

std::string file_text(const fs::path& path) {
  std::ostringstream text;
  text << std::ifstream(path).rdbuf();
  return text.str();
}

std::vector<Golden> all_golden() {
  std::vector<Golden> all;
  for (const fs::directory_entry& entry : fs::directory_iterator(kGolden)) {
    if (entry.path().extension() != ".txt") continue;
    Golden golden{entry.path().stem().string(), "", file_text(entry.path()), entry.path()};
    golden.hex.replace_extension(".hex");
    constexpr std::string_view kMark = "# proto-message: ";
    const std::size_t at = golden.text.find(kMark) + kMark.size();
    golden.type = golden.text.substr(at, golden.text.find('\n', at) - at);
    all.push_back(std::move(golden));
  }
  std::ranges::sort(all, {}, &Golden::name);
  return all;
}

// 16 bytes a line.
std::string to_hex(const std::string& bytes) {
  std::string hex;
  for (std::size_t i = 0; i < bytes.size(); ++i) {
    constexpr char kDigits[] = "0123456789abcdef";
    const auto byte = static_cast<unsigned char>(bytes[i]);
    hex += {kDigits[byte >> 4], kDigits[byte & 15]};
    hex += i % 16 == 15 || i + 1 == bytes.size() ? '\n' : ' ';
  }
  return hex;
}

std::string from_hex(const std::string& hex) {
  std::istringstream stream(hex);
  std::string bytes;
  for (std::string pair; stream >> pair;) bytes += static_cast<char>(std::stoi(pair, nullptr, 16));
  return bytes;
}

std::string bytes_of(const Golden& golden) { return from_hex(file_text(golden.hex)); }

// The columns of a golden message's type; none for a message of the control stream.
Infos infos_of(const Golden& golden) {
  for (const MessageType& type : all_message_types())
    if (type.descriptor->full_name() == golden.type) return type.infos;
  return {};
}

TEST(GoldenMessages, AreTheBytesOfTheirTexts) {
  const std::vector<Golden> all = all_golden();
  std::set<std::string> hex_files;
  for (const Golden& golden : all) {
    SCOPED_TRACE(golden.name);
    const pb::Descriptor* type = schemas().type(golden.type);
    ASSERT_NE(type, nullptr) << golden.type;
    const std::unique_ptr<pb::Message> message = schemas().message(type);
    ASSERT_TRUE(pb::TextFormat::ParseFromString(golden.text, message.get()));
    const std::string hex = to_hex(serialized(*message));
    if (std::getenv("GRAVITAS_WRITE_GOLDEN") != nullptr) std::ofstream(golden.hex) << hex;
    EXPECT_EQ(file_text(golden.hex), hex)
        << "if the text was meant to change: GRAVITAS_WRITE_GOLDEN=1 build/release/bin/test_schemas";
    hex_files.insert(golden.hex.filename().string());
  }
  for (const fs::directory_entry& entry : fs::directory_iterator(kGolden)) {
    if (entry.path().extension() == ".hex") {
      EXPECT_TRUE(hex_files.contains(entry.path().filename().string())) << entry.path() << " has no text";
    }
  }
}

TEST(GoldenMessages, AreReadAndWrittenByTheCodecByteForByte) {
  int stage_messages = 0;
  for (const Golden& golden : all_golden()) {
    const Infos infos = infos_of(golden);
    if (infos.empty()) continue;
    SCOPED_TRACE(golden.name);
    ++stage_messages;
    const std::string bytes = bytes_of(golden);
    wire::ColumnsReader reader(infos);
    ASSERT_EQ(reader.parse(bytes_of(bytes)), "");
    std::string again = written(infos, columns_read(infos, reader).plain());
    if (reader.header().has) again = with_submessage(again, wire::kHeader, reader.header().bytes);
    if (reader.derivative().has) again = with_submessage(again, wire::kDerivative, reader.derivative().bytes);
    if (reader.asset().has) again = with_submessage(again, wire::kAsset, reader.asset().bytes);
    EXPECT_EQ(to_hex(again), to_hex(bytes));
  }
  EXPECT_GE(stage_messages, 10);
}

// What the texts say the columns are, number by number.
TEST(GoldenMessages, TheForcesRequestHasItsColumnsAndItsDigest) {
  const stage::MethodInfo& method = stage::method_info(stage::Method::kForceWrenches);
  const std::string bytes = from_hex(file_text(kGolden / "force_wrenches_request.hex"));
  wire::ColumnsReader reader(method.request);
  ASSERT_EQ(reader.parse(bytes_of(bytes)), "");
  const MessageColumns columns = columns_read(method.request, reader);
  EXPECT_EQ(columns.f64("time"), std::vector<double>{0.25});
  EXPECT_EQ(columns.u64("force_type"), std::vector<std::uint64_t>{2021754986717315747U});
  EXPECT_EQ(columns.u32("application"), (std::vector<std::uint32_t>{0, 1}));
  EXPECT_EQ(columns.f64("linear_velocity"), (std::vector<double>{0, 0, 0, 3, 4, 0}));

  const std::unique_ptr<pb::Message> call = schemas().message(schemas().type("gravitas.stage.v1.Call"));
  ASSERT_TRUE(call->ParseFromArray(reader.header().bytes.data(), static_cast<int>(reader.header().bytes.size())));
  const pb::FieldDescriptor* digest = call->GetDescriptor()->FindFieldByName("digest");
  EXPECT_EQ(call->GetReflection()->GetUInt64(*call, digest), wire::columns_digest(method.request, columns.plain()));
}

// ---- bytes that are no message

// Reads a message as every one of the stage's types; what is read has the size it says.
void read_as_everything(const std::string& bytes) {
  for (const stage::MethodInfo& method : stage::kMethods) {
    for (const Infos infos : {method.request, method.reply}) {
      wire::ColumnsReader reader(infos);
      if (!reader.parse(bytes_of(bytes)).empty()) continue;
      const MessageColumns columns = columns_read(infos, reader);
      // no element takes less than a byte, so nothing is read that was not sent
      for (std::size_t i = 0; i < infos.size(); ++i) ASSERT_LE(reader.count(i), bytes.size() + 1);
      // what was understood is what would be written
      wire::ColumnsReader again(infos);
      const std::string rewritten = written(infos, columns.plain());
      ASSERT_EQ(again.parse(bytes_of(rewritten)), "");
      ASSERT_EQ(columns_read(infos, again).bytes(), columns.bytes());
    }
  }
}

TEST(GoldenMessages, AreReadOrRefusedWhereverTheyBreakOff) {
  for (const Golden& golden : all_golden()) {
    SCOPED_TRACE(golden.name);
    const std::string bytes = bytes_of(golden);
    for (std::size_t size = 0; size < bytes.size(); ++size) read_as_everything(bytes.substr(0, size));
  }
}

TEST(GoldenMessages, AreReadOrRefusedWithAnyBitOrByteChanged) {
  for (const Golden& golden : all_golden()) {
    SCOPED_TRACE(golden.name);
    const std::string bytes = bytes_of(golden);
    for (std::size_t at = 0; at < bytes.size(); ++at) {
      for (int bit = 0; bit < 8; ++bit) {
        std::string changed = bytes;
        changed[at] = static_cast<char>(changed[at] ^ (1 << bit));
        read_as_everything(changed);
      }
      for (const char value : {'\x00', '\x7F', '\x80', '\xFF'}) {
        std::string changed = bytes;
        changed[at] = value;
        read_as_everything(changed);
      }
    }
  }
}

TEST(Wire, RandomBytesAreReadOrRefused) {
  Random random(3);
  for (int trial = 0; trial < 5000; ++trial) {
    std::string bytes(random() % 64, '\0');
    for (char& byte : bytes) byte = static_cast<char>(random());
    read_as_everything(bytes);
  }
}

}  // namespace
}  // namespace gravitas
