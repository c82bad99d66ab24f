// Tests engine/format/safetensors.h.
#include <catch2/catch.hpp>

#include <csignal>
#include <cstring>

#include <sys/resource.h>

#include "base/error.h"
#include "format/safetensors.h"
#include "temporary_folder.h"

using namespace trisoup;
using namespace trisoup::soup;

namespace {

std::string with_header(const std::string& json, const std::string& data) {
  const std::uint64_t size = json.size();
  return std::string(reinterpret_cast<const char*>(&size), sizeof size) + json + data;
}

std::string message_of(const std::filesystem::path& path) {
  try {
    Safetensors::open(path);
  } catch (const Error& error) {
    return error.what();
  }
  return "";
}

}  // namespace

TEST_CASE("safetensors: arrays are read back unchanged", "[safetensors]") {
  const test::TemporaryFolder folder;
  const std::vector<float> floats{1, -2.5f, 3, 4, 5, 6};
  const std::vector<std::uint8_t> bytes{1, 2, 3};
  const std::vector<double> doubles{0.1};
  const std::vector<std::int64_t> longs{-5, 1ll << 60};
  const std::vector<std::uint32_t> words{7, 8, 9};
  SafetensorsWriter writer;
  writer.add<std::uint8_t>("bytes", {3}, bytes);
  writer.add<float>("soup.vertices", {2, 3}, floats);
  writer.add<double>("scalar", {}, doubles);
  writer.add<std::int64_t>("longs", {2, 1}, longs);
  writer.add<std::uint32_t>("words", {3}, words);
  writer.add<float>("nothing", {0, 3}, {});
  writer.metadata({{"step", "1234"}, {"note", "quoted \"text\", \u00e9"}});
  const auto path = folder / "c.safetensors";
  writer.write(path);

  const Safetensors file = Safetensors::open(path);
  CHECK(file.tensors().size() == 6);
  const auto read = file.floats("soup.vertices");
  CHECK(std::vector<float>(read.begin(), read.end()) == floats);
  CHECK(file.info("soup.vertices").shape == std::vector<std::uint64_t>{2, 3});
  CHECK(file.values<float>("soup.vertices", {2, 3}).size() == 6);
  CHECK(file.values<std::uint8_t>("bytes")[2] == 3);
  CHECK(file.values<double>("scalar")[0] == 0.1);
  CHECK(file.info("scalar").shape.empty());
  CHECK(file.values<std::int64_t>("longs")[1] == 1ll << 60);
  CHECK(file.values<std::uint32_t>("words")[2] == 9);
  CHECK(file.floats("nothing").empty());
  CHECK(file.metadata().at("step") == "1234");
  CHECK(file.metadata().at("note") == "quoted \"text\", \u00e9");

  CHECK(file.contains("words"));
  CHECK_FALSE(file.contains("other"));
  CHECK_THROWS_AS(file.info("other"), Error);
  CHECK_THROWS_AS(file.floats("words"), Error);
  CHECK_THROWS_AS(file.values<float>("soup.vertices", {3, 2}), Error);

  // The format: length of the header, JSON, aligned data directly after it.
  const std::string raw = test::content_of(path);
  std::uint64_t header = 0;
  std::memcpy(&header, raw.data(), 8);
  CHECK(header % 8 == 0);
  CHECK(raw[8] == '{');
  CHECK(raw.size() == 8 + header + 24 + 3 + 8 + 16 + 12);
  for (const auto& [name, tensor] : file.tensors()) CHECK(tensor.begin % size_of(tensor.dtype) == 0);
}

TEST_CASE("safetensors: no arrays at all", "[safetensors]") {
  const test::TemporaryFolder folder;
  SafetensorsWriter{}.write(folder / "empty.safetensors");
  CHECK(Safetensors::open(folder / "empty.safetensors").tensors().empty());
}

TEST_CASE("safetensors: the writer refuses invalid arrays", "[safetensors]") {
  SafetensorsWriter writer;
  const std::vector<float> values{1, 2, 3};
  writer.add<float>("a", {3}, values);
  CHECK_THROWS_AS(writer.add<float>("a", {3}, values), Error);
  CHECK_THROWS_AS(writer.add<float>("b", {2}, values), Error);
  CHECK_THROWS_AS(writer.add<float>("", {3}, values), Error);
  CHECK_THROWS_AS(writer.add<float>("__metadata__", {3}, values), Error);
  CHECK_THROWS_AS(writer.add<float>("c", {1ull << 62, 4}, values), Error);
  writer.metadata({{"bad", "\xff\xfe"}});
  const test::TemporaryFolder folder;
  CHECK_THROWS_AS(writer.write(folder / "a.safetensors"), Error);
  CHECK_FALSE(std::filesystem::exists(folder / "a.safetensors"));
}

TEST_CASE("safetensors: a truncated file is an error", "[safetensors]") {
  const test::TemporaryFolder folder;
  const std::vector<float> values{1, 2, 3};
  SafetensorsWriter writer;
  writer.add<float>("a", {3}, values);
  writer.write(folder / "whole");
  const std::string whole = test::content_of(folder / "whole");
  for (std::size_t size = 0; size < whole.size(); ++size) {
    const std::string message = message_of(folder.file("cut", whole.substr(0, size)));
    CHECK_FALSE(message.empty());
    CHECK(message.find('\n') == std::string::npos);
  }
  CHECK_FALSE(message_of(folder.file("longer", whole + "x")).empty());
  CHECK_FALSE(message_of(folder / "missing").empty());
  CHECK_FALSE(message_of(folder.path()).empty());
}

TEST_CASE("safetensors: an invalid header is an error", "[safetensors]") {
  using Catch::Matchers::Contains;
  const test::TemporaryFolder folder;
  const auto message = [&](const std::string& json, std::size_t data = 8) {
    return message_of(folder.file("f", with_header(json, std::string(data, '\0'))));
  };
  CHECK(message(R"({"a":{"dtype":"F32","shape":[2],"data_offsets":[0,8]}})").empty());
  CHECK_THAT(message(""), Contains("not a JSON object"));
  CHECK_THAT(message("[1]"), Contains("not a JSON object"));
  CHECK_THAT(message(R"({"a":1})"), Contains("'a'"));
  CHECK_THAT(message(R"({"a":{"dtype":"F32","shape":[2]}})"), Contains("data_offsets"));
  CHECK_THAT(message(R"({"a":{"dtype":"F32","shape":[2],"data_offsets":[0]}})"), Contains("data_offsets"));
  CHECK_THAT(message(R"({"a":{"dtype":"F32","shape":[-2],"data_offsets":[0,8]}})"), Contains("shape"));
  CHECK_THAT(message(R"({"a":{"dtype":"F32","shape":[2.0],"data_offsets":[0,8]}})"), Contains("shape"));
  CHECK_THAT(message(R"({"a":{"dtype":"BF16","shape":[4],"data_offsets":[0,8]}})"), Contains("BF16"));
  CHECK_THAT(message(R"({"a":{"dtype":"F32","shape":[2],"data_offsets":[0,16]}})"), Contains("truncated"));
  CHECK_THAT(message(R"({"a":{"dtype":"F32","shape":[2],"data_offsets":[8,0]}})"), Contains("8..0"));
  CHECK_THAT(message(R"({"a":{"dtype":"F32","shape":[3],"data_offsets":[0,8]}})"), Contains("shape"));
  CHECK_THAT(message(R"({"a":{"dtype":"F32","shape":[4294967296,4294967296,4294967298],"data_offsets":[0,8]}})"),
             Contains("shape"));
  CHECK_THAT(message(R"({"a":{"dtype":"F32","shape":[1],"data_offsets":[0,4]},)"
                     R"("b":{"dtype":"F32","shape":[2],"data_offsets":[0,8]}})"),
             Contains("overlap"));
  CHECK_THAT(message(R"({"a":{"dtype":"F32","shape":[1],"data_offsets":[4,8]}})"), Contains("gap"));
  CHECK_THAT(message(R"({"a":{"dtype":"F32","shape":[1],"data_offsets":[0,4]}})"), Contains("belong to no array"));
  CHECK_THAT(message(R"({"a":{"dtype":"U8","shape":[2],"data_offsets":[0,2]},)"
                     R"("b":{"dtype":"F32","shape":[1],"data_offsets":[2,6]}})",
                     6),
             Contains("aligned"));
  CHECK_THAT(message(R"({"a":{"dtype":"F32","shape":[2],"data_offsets":[0,8]},)"
                     R"("a":{"dtype":"F32","shape":[2],"data_offsets":[0,8]}})"),
             Contains("twice"));
  CHECK_THAT(message(R"({"__metadata__":{"step":7},"a":{"dtype":"F32","shape":[2],"data_offsets":[0,8]}})"),
             Contains("'step'"));
  CHECK_THAT(message_of(folder.file("f", std::string(8, '\xff') + "{}")), Contains("its header should have"));
}

TEST_CASE("safetensors: a failed write keeps the earlier checkpoint", "[safetensors]") {
  const test::TemporaryFolder folder;
  const std::vector<float> values{1, 2, 3};
  SafetensorsWriter writer;
  writer.add<float>("a", {3}, values);
  writer.write(folder / "c");
  const std::vector<float> many(100'000);
  writer.add<float>("b", {many.size()}, many);

  rlimit before{};
  ::getrlimit(RLIMIT_FSIZE, &before);
  const auto handler = std::signal(SIGXFSZ, SIG_IGN);
  const rlimit limit{10'000, before.rlim_max};
  ::setrlimit(RLIMIT_FSIZE, &limit);
  CHECK_THROWS_AS(writer.write(folder / "c"), Error);
  ::setrlimit(RLIMIT_FSIZE, &before);
  std::signal(SIGXFSZ, handler);

  CHECK(Safetensors::open(folder / "c").floats("a")[2] == 3);
  CHECK(std::distance(std::filesystem::directory_iterator(folder.path()), {}) == 1);
}
