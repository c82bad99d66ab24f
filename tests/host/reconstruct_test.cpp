// Tests engine/scene/reconstruct/reconstruct.h, unposed.h, video_frames.h and base/child_process.h with fake programs.
#include <catch2/catch.hpp>

#include <signal.h>

#include <chrono>
#include <cstdlib>
#include <thread>

#include "base/child_process.h"
#include "base/error.h"
#include "base/printable.h"
#include "packed.h"
#include "scene/datasets/dataset.h"
#include "scene/reconstruct/colmap_program.h"
#include "scene/reconstruct/reconstruct.h"
#include "scene/reconstruct/video_frames.h"
#include "scene_temporary_folder.h"

using namespace trisoup;
using namespace trisoup::scene;
using Catch::Matchers::Contains;
using test::pack;
using test::SceneFolder;
namespace fs = std::filesystem;

namespace {

// Script of the fake COLMAP, besides logging its calls. $out is the output folder of the mapper; `model N NAMES...`
// writes a model there.
constexpr const char* kColmap = R"(#!/bin/bash
here=$(dirname "$0")
command=$1
printf '%s\n' "$*" >>"$here/calls"
while [ $# -gt 0 ]; do
  case $1 in
    --database_path) database=$2 ;;
    --output_path) out=$2 ;;
  esac
  shift
done
model() {
  mkdir -p "$out/$1"
  cp "$here/models/$2"/*.bin "$out/$1"
}
[ "$command" = mapper ] || echo data >>"$database"
[ "$command" = mapper ] || echo "Processed file [1/4]"
)";

/// A folder of photographs, fake programs first in PATH, and the messages.
struct Stage {
  SceneFolder folder;
  std::string path = std::getenv("PATH");
  std::vector<std::string> warnings, progress;
  std::atomic<bool> stop = false;
  ReconstructOptions options;

  explicit Stage(const std::vector<std::string>& names = {"a.png", "b.png", "c.png", "d.png"}) {
    for (const std::string& name : names) folder.write("photographs/" + name, test::plain(8, 6, 1, 2, 3));
    ::setenv("PATH", ((folder / "bin").string() + ":/usr/bin:/bin").c_str(), 1);
    options.warn = [&](const std::string& line) { warnings.push_back(line); };
    options.progress = [&](const std::string& stage, int done, int total) {
      progress.push_back(fmt::format("{} {}/{}", stage, done, total));
    };
  }
  ~Stage() { ::setenv("PATH", path.c_str(), 1); }

  void program(const std::string& name, const std::string& text) {
    folder.write("bin/" + name, text);
    fs::permissions(folder / "bin" / name, fs::perms::owner_all);
  }
  void colmap(const std::string& mapper) {
    program("colmap", kColmap + ("[ \"$command\" != mapper ] || {\n" + mapper + "\n}\n"));
  }
  /// Creates a model of these photographs for the fake mapper.
  void model(const std::string& name, const std::vector<std::string>& names, double fx = 9, double fy = 9) {
    std::string images = pack(std::uint64_t(names.size()));
    for (std::size_t i = 0; i < names.size(); ++i)
      images += pack(std::uint32_t(i + 1), 1.0, 0.0, 0.0, 0.0, double(i), 0.0, 3.0, std::uint32_t(1)) + names[i] +
                '\0' + pack(std::uint64_t(0));
    folder.write("bin/models/" + name + "/images.bin", images);
    folder.write("bin/models/" + name + "/cameras.bin", pack(std::uint64_t(1), std::uint32_t(1), std::int32_t(1),
                                                             std::uint64_t(8), std::uint64_t(6), fx, fy, 4.0, 3.0));
    folder.write("bin/models/" + name + "/points3D.bin", pack(std::uint64_t(0)));
  }
  Reconstruction run(const char* dataset = "photographs") {
    const auto unposed = find_unposed(folder / dataset);
    if (!unposed) throw Error("there are poses, or nothing");
    return reconstruct(*unposed, folder / "out/colmap", options, stop);
  }
  std::string calls() const { return test::content_of(folder / "bin/calls"); }
  fs::path out(const std::string& name) const { return folder / "out/colmap" / name; }
};

std::string joined(const std::vector<std::string>& lines) {
  std::string text;
  for (const std::string& line : lines) text += line + "\n";
  return text;
}

}  // namespace

TEST_CASE("progress is read from the output of COLMAP", "[reconstruct]") {
  const auto text = [](const char* line) {
    const auto p = colmap_progress(line);
    return p ? fmt::format("{}/{}", p->done, p->total) : "";
  };
  CHECK(text("Processed file [3/20]") == "3/0");
  CHECK(text("Matching block [2/3, 1/3] in 0.5s") == "4/9");
  CHECK(text("Matching image [7/160] in 0.5s") == "7/160");
  CHECK(text("Matching block [2/7] in 0.5s") == "2/7");
  CHECK(text("Registering image #12 (5)") == "4/0");
  for (const char* line :
       {"", "Processed file [", "Processed file [9/3]", "Matching block [9/3]", "Matching block [0/3, 1/3]",
        "Matching block [9999999/9999999, 1/9999999]", "  Name: Processed file [1/2]", "Elapsed time: 0.2 [minutes]"})
    CHECK(text(line) == "");
}

TEST_CASE("names in a message are shortened", "[reconstruct]") {
  CHECK(some_names({"a"}) == "a");
  CHECK(some_names({"1", "2", "3", "4", "5", "6", "7", "8"}) == "1, 2, 3, 4, 5, 6, 7, 8");
  CHECK(some_names({"1", "2", "3", "4", "5", "6", "7", "8", "9", "\n"}) == "1, 2, 3, 4, 5, 6, 7, 8 and 2 more");
}

TEST_CASE("poses take precedence over photographs, and images/ over the folder", "[reconstruct]") {
  SceneFolder folder;
  folder.write("a.PNG", test::plain(2, 2, 0, 0, 0));
  folder.write("._a.png", "hidden");
  folder.write("note.txt", "");
  folder.write("further/b.png", test::plain(2, 2, 0, 0, 0));
  REQUIRE(find_unposed(folder.path()));
  CHECK(find_unposed(folder.path())->names == std::vector<std::string>{"a.PNG"});
  folder.write("images/it's one.JPeG", "x");
  CHECK(find_unposed(folder.path())->names == std::vector<std::string>{"it's one.JPeG"});
  CHECK_THAT(test::message_of([&] { read_dataset(folder.path(), 1); }), Contains("without poses"));
  folder.write("transforms.json", "{}");
  CHECK_FALSE(find_unposed(folder.path()));
  CHECK_FALSE(find_unposed(folder / "nowhere"));
  CHECK_FALSE(find_unposed(folder / "note.txt"));
  folder.write("empty/.keep", "");
  CHECK_FALSE(find_unposed(folder / "empty"));
  CHECK_THAT(test::message_of([&] { read_dataset(folder / "empty", 1); }), Contains("nor photographs"));
  folder.write("film.MOV", "x");
  REQUIRE(find_unposed(folder / "film.MOV"));
  CHECK(find_unposed(folder / "film.MOV")->video == folder / "film.MOV");
  folder.write("sparse/0/images.bin", "");
  fs::remove(folder / "transforms.json");
  CHECK_FALSE(find_unposed(folder.path()));
}

TEST_CASE("photographs are reconstructed once and become a dataset", "[reconstruct]") {
  Stage s({"a b.png", "it's.png", "\"c\".png", "d.png"});
  s.model("all", {"a b.png", "it's.png", "\"c\".png", "d.png"});
  s.colmap("echo 'Registering image #1 (3)'; model 0 all");
  const Reconstruction first = s.run();
  CHECK((first.registered == 4 && first.photographs == 4 && !first.reused));
  CHECK(s.warnings.empty());
  CHECK_THAT(joined(s.progress), Contains("photographs 4/4") && Contains("features 1/4") && Contains("matching 0/4") &&
                                     Contains("poses 2/4"));
  CHECK_THAT(s.calls(), Contains("exhaustive_matcher") &&
                            Contains("single_camera 1 --ImageReader.camera_model SIMPLE_RADIAL") &&
                            Contains("max_image_size 1600"));
  CHECK(read_dataset(first.dataset, 1).frames.size() == 4);
  CHECK_THAT(test::content_of(s.out("log.txt")), Contains("Processed file") && Contains("Registering image"));

  const std::string calls = s.calls();
  fs::remove(s.folder / "bin/colmap");  // no longer needed
  CHECK(s.run().reused);
  CHECK(s.calls() == calls);

  s.folder.write("photographs/e.png", test::plain(9, 6, 1, 2, 3));
  s.colmap("model 0 all");
  s.options.resume = true;
  CHECK_THAT(test::message_of([&] { s.run(); }), Contains("other photographs") && Contains("`overwrite`"));
  CHECK(fs::exists(s.out("sparse/0/images.bin")));
  s.options.resume = false;
  CHECK(s.run().registered == 4);
  CHECK_THAT(joined(s.warnings), Contains("1 of 5 photographs have no pose") && Contains("e.png"));
  // Each image size has its own camera.
  CHECK(s.calls().substr(calls.size()).find("feature_extractor") !=
        s.calls().substr(calls.size()).rfind("feature_extractor"));
  CHECK_THAT(joined(s.progress), Contains("features 4/5") && Contains("features 5/5"));
}

TEST_CASE("the largest of several models is used", "[reconstruct]") {
  Stage s;
  s.model("two", {"a.png", "b.png"});
  s.model("three", {"b.png", "c.png", "d.png"});
  s.colmap("model 0 two; model 1 three; model 2 two");
  CHECK(s.run().registered == 3);
  CHECK_THAT(joined(s.warnings), Contains("3 parts that COLMAP could not connect, of 3, 2, 2 photographs") &&
                                     Contains("photographs between a.png and b.png would connect them") &&
                                     Contains("1 of 4 photographs have no pose and are left out: a.png;"));
  CHECK_FALSE(fs::exists(s.out("sparse/1")));
}

TEST_CASE("cameras that cannot be true are mapped again with EXIF's focal length", "[reconstruct][cameras]") {
  Stage s;
  s.model("bent", {"a.png", "b.png", "c.png", "d.png"}, 9, 2);
  s.model("true", {"a.png", "b.png", "c.png"}, 9, 9);
  s.program("colmap", std::string(kColmap) + R"sh(
[ "$command" != feature_extractor ] || echo "  Focal Length:    10.00px (Prior)"
[ "$command" != mapper ] || {
  case $(tail -n 1 "$here/calls") in
    *refine_focal_length*) model 0 true ;;
    *) model 0 bent ;;
  esac
}
)sh");
  const Reconstruction found = s.run();
  CHECK(found.registered == 3);
  CHECK_THAT(found.cameras, Contains("focal length 9 pixels (EXIF 10)") &&
                                Contains("best of 3 mappings: focal length held at EXIF's"));
  CHECK_THAT(joined(s.progress), Contains("poses 0/4") && Contains("poses, try 2 0/4") && Contains("try 3"));
  CHECK_THAT(joined(s.warnings), !Contains("cannot be true"));
  CHECK_FALSE(fs::exists(s.out("sparse.partial")));
  const Reconstruction again = s.run();
  CHECK(again.reused);
  CHECK_THAT(again.cameras, Contains("(EXIF 10)"));
}

TEST_CASE("cameras that stay untrue are told, and a failure of a later mapping costs nothing",
          "[reconstruct][cameras]") {
  Stage s;
  s.model("bent", {"a.png", "b.png", "c.png", "d.png"}, 9, 2);
  s.colmap("[ -e \"$here/second\" ] && exit 3; touch \"$here/second\"; model 0 bent");
  CHECK(s.run().registered == 4);
  CHECK_THAT(joined(s.warnings), Contains("cannot be true (focal lengths of 9 and 2 pixels") && Contains("EXIF"));
}

TEST_CASE("many photographs are matched with neighbours and in loops, with a warning", "[reconstruct][cameras]") {
  std::vector<std::string> names;
  for (std::size_t i = 0; i <= kMostExhaustive; ++i) names.push_back(fmt::format("{:03}.png", i));
  Stage s(names);
  s.model("all", names);
  s.colmap("model 0 all");
  CHECK(s.run().registered == names.size());
  CHECK_THAT(joined(s.warnings), Contains("201 photographs, too many to match each with all others"));
  CHECK_THAT(s.calls(), Contains("sequential_matcher") && Contains("matches_importer"));
  CHECK_THAT(test::content_of(s.out("loops.txt")), Contains("000.png 015.png\n") && Contains("000.png 195.png\n"));
  CHECK_THAT(joined(s.progress), Contains("matching loops 0/40"));
}

TEST_CASE("too few photographs with poses are an error that names the others", "[reconstruct]") {
  Stage s;
  s.model("two", {"a.png", "b.png"});
  s.colmap("model 0 two");
  CHECK_THAT(test::message_of([&] { s.run(); }),
             Contains("2 of 4") && Contains("c.png, d.png") && Contains("log.txt") && Contains("overlapping"));
  s.colmap("echo 'ERROR: failed to create sparse model'; exit 1");
  s.folder.write("photographs/new.png", test::plain(8, 6, 1, 2, 3));
  CHECK_THAT(test::message_of([&] { s.run(); }), Contains("0 of 5"));
  CHECK_FALSE(fs::exists(s.out("sparse")));
}

TEST_CASE("damaged photographs are skipped, and too few are refused before COLMAP starts", "[reconstruct]") {
  Stage s;
  s.folder.write("photographs/bad.jpg", "no photograph");
  s.model("all", {"a.png", "b.png", "c.png", "d.png"});
  s.colmap("model 0 all");
  CHECK(s.run().registered == 4);
  CHECK_THAT(joined(s.warnings), Contains("1 of 5 photographs cannot be read and are left out: bad.jpg"));
  CHECK(test::content_of(s.out("photographs.txt")) == "a.png\nb.png\nc.png\nd.png\n");
  Stage few({"a.png", "b.png"});
  few.colmap("model 0 all");
  CHECK_THAT(test::message_of([&] { few.run(); }), Contains("too few photographs") && Contains("2 can be used"));
  CHECK(few.calls().empty());
}

TEST_CASE("a failure of COLMAP is reported in one line", "[reconstruct]") {
  Stage s;
  s.colmap("echo 'F1123 Check failed: no memory'; echo more; exit 3");
  const std::string message = test::message_of([&] { s.run(); });
  CHECK_THAT(message, Contains("mapper failed: F1123 Check failed: no memory") && Contains("log.txt"));
  CHECK(message.find('\n') == std::string::npos);
  s.colmap("kill -KILL $$");
  CHECK_THAT(test::message_of([&] { s.run(); }), Contains("signal 9"));
  // Features and matches were complete and are reused.
  const std::string calls = s.calls();
  CHECK(calls.find("feature_extractor") == calls.rfind("feature_extractor"));
  s.program("colmap", "#!/bin/bash\necho 'unrecognised option --x'\nexit 1\n");
  s.folder.write("photographs/a.png", test::plain(8, 7, 1, 2, 3));
  CHECK_THAT(test::message_of([&] { s.run(); }), Contains("feature_extractor failed: unrecognised option --x"));
  CHECK_FALSE(fs::exists(s.out("database.db")));
}

TEST_CASE("missing programs are named with the command that installs them", "[reconstruct]") {
  Stage s;
  ::setenv("PATH", (s.folder / "bin").c_str(), 1);
  CHECK_THAT(test::message_of([&] { s.run(); }),
             Contains("colmap is not installed") && Contains("apt-get install colmap"));
  s.folder.write("film.mp4", "x");
  CHECK_THAT(test::message_of([&] { s.run("film.mp4"); }),
             Contains("ffmpeg is not installed") && Contains("apt-get install ffmpeg"));
  CHECK_FALSE(fs::exists(s.folder / "out"));
}

TEST_CASE("a folder of other origin is not overwritten", "[reconstruct]") {
  Stage s;
  s.colmap("exit 1");
  s.folder.write("out/colmap/database.db", "precious");
  CHECK_THAT(test::message_of([&] { s.run(); }), Contains("not made by this program"));
  CHECK(test::content_of(s.out("database.db")) == "precious");
}

TEST_CASE("stopping ends COLMAP and leaves no partial results, and the next start continues", "[reconstruct]") {
  Stage s;
  s.model("all", {"a.png", "b.png", "c.png", "d.png"});
  // Ignores the request to end.
  s.colmap("trap '' TERM; echo $$ >\"$here/pid\"; model 0 all; while :; do read -t 0.1 <> <(:) || :; done");
  std::jthread stopper([&] {
    for (int i = 0; i < 500 && test::content_of(s.folder / "bin/pid").empty(); ++i)
      std::this_thread::sleep_for(std::chrono::milliseconds(20));
    s.stop = true;
  });
  CHECK_THROWS_AS(s.run(), ReconstructionStopped);
  const int pid = std::atoi(test::content_of(s.folder / "bin/pid").c_str());
  REQUIRE(pid > 0);
  CHECK(::kill(pid, 0) != 0);
  CHECK_FALSE(fs::exists(s.out("sparse")));
  CHECK_FALSE(has_poses(s.out("")));
  s.stop = false;
  s.colmap("model 0 all");
  CHECK_FALSE(s.run().reused);
  const std::string calls = s.calls();
  CHECK(calls.find("feature_extractor") == calls.rfind("feature_extractor"));
  CHECK_FALSE(fs::exists(s.out("sparse.partial")));
}

TEST_CASE("sharpness distinguishes blurred frames, and each window yields its sharpest frame", "[reconstruct]") {
  Image sharp = test::plain(20, 20, 0, 0, 0), soft = sharp;
  for (int y = 0; y < 20; ++y)
    for (int x = 0; x < 20; ++x)
      for (int c = 0; c < 3; ++c) {
        sharp.rgba[std::size_t(4 * (20 * y + x) + c)] = x < 10 ? 0 : 255;
        soft.rgba[std::size_t(4 * (20 * y + x) + c)] = static_cast<std::uint8_t>(x * 12);
      }
  CHECK(sharpness(sharp) > 10 * sharpness(soft));
  CHECK(sharpness(test::plain(1, 1, 0, 0, 0)) == 0);
  using Chosen = std::vector<std::size_t>;
  const std::vector<double> values{1, 5, 2, 9, 3, 4, 0};
  CHECK(sharpest_of_windows(values, 3) == Chosen{1, 3, 5});
  CHECK(sharpest_of_windows(values, 100) == Chosen{0, 1, 2, 3, 4, 5, 6});
  CHECK(sharpest_of_windows({}, 3).empty());
}

TEST_CASE("frames are extracted from a video once", "[reconstruct]") {
  Stage s;
  s.folder.write("a film.mp4", "x");
  s.program("ffprobe", "#!/bin/bash\necho duration=10.0\n");
  // The fake frames are named .jpg; the reader goes by their contents.
  s.program("ffmpeg",
            "#!/bin/bash\nout=${!#}\necho \"$*\" >>\"$(dirname \"$0\")/calls\"\nfor i in 1 2 3 4; do cp \"$(dirname "
            "\"$0\")/../photographs/a.png\" \"$(printf \"$out\" $i)\"; done\necho frame=4\n");
  s.model("all", {"frame_0001.jpg", "frame_0002.jpg", "frame_0003.jpg", "frame_0004.jpg"});
  s.colmap("exit 3");
  CHECK_THAT(test::message_of([&] { s.run("a film.mp4"); }), Contains("mapper failed"));
  CHECK_THAT(joined(s.progress), Contains("frames 4/480") && Contains("sharpness 4/4"));
  CHECK_THAT(s.calls(), Contains("sequential_matcher") && Contains("file:/") && Contains("a film.mp4"));
  s.colmap("model 0 all");
  const Reconstruction r = s.run("a film.mp4");
  CHECK((r.registered == 4 && r.photographs == 4));
  CHECK(s.calls().find("file:") == s.calls().rfind("file:"));  // frames were complete
  CHECK(s.run("a film.mp4").reused);

  fs::remove_all(s.out("sparse"));
  CHECK_THAT(test::message_of([&] { s.run("out/colmap"); }), Contains("is inside the output folder for poses"));
  CHECK(fs::exists(s.out("images/frame_0001.jpg")));

  s.folder.write("a film.mp4", "other");
  s.program("ffmpeg", "#!/bin/bash\necho 'moov atom not found'\nexit 1\n");
  CHECK_THAT(test::message_of([&] { s.run("a film.mp4"); }),
             Contains("ffmpeg cannot extract frames (moov atom not found)"));
  CHECK_FALSE(fs::exists(s.out("images")));
}

TEST_CASE("what ffprobe says about colours decides how frames are converted", "[reconstruct][video]") {
  const auto filters = [](std::initializer_list<const char*> lines) {
    scene::VideoFacts facts;
    for (const char* line : lines) facts.take(line);
    return facts.colour_filters();
  };
  CHECK(filters({}).empty());
  CHECK(filters({"color_space=unknown", "color_transfer=unknown", "duration=N/A"}).empty());
  CHECK(filters({"color_space=smpte170m", "color_primaries=smpte170m"}).empty());
  CHECK(filters({"color_space=bt709", "color_transfer=bt709"}) == ",scale=out_color_matrix=bt601");
  for (const char* transfer : {"color_transfer=arib-std-b67", "color_transfer=smpte2084"})
    CHECK_THAT(filters({"color_space=bt2020nc", "color_primaries=bt2020", transfer}),
               Contains("tonemap") && Contains("t=iec61966-2-1:m=170m:r=full"));
  const std::string wide = filters({"color_primaries=bt2020", "color_transfer=bt709"});
  CHECK_THAT(wide, Contains("zscale=p=bt709") && !Contains("tonemap"));
  scene::VideoFacts facts;
  facts.take("duration=12.5");
  facts.take("12.5");
  CHECK(facts.seconds == 12.5);
}

TEST_CASE("a video of high dynamic range needs an ffmpeg with zscale", "[reconstruct][video]") {
  Stage s;
  s.folder.write("a film.mp4", "not really");
  s.program("ffprobe", "#!/bin/bash\necho color_transfer=arib-std-b67\necho color_primaries=bt2020\n");
  s.program("ffmpeg", "#!/bin/bash\necho ' .S. tonemap V->V'\n");
  s.colmap("exit 3");
  CHECK_THAT(test::message_of([&] { s.run("a film.mp4"); }),
             Contains("a film.mp4: has high dynamic range (arib-std-b67, bt2020)") && Contains("zscale"));
}
