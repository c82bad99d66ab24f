#include <set>
#include <string>
#include <string_view>

#include <catch2/catch.hpp>

#include "pages/http_guard.h"
#include "pages/http_server.h"

using namespace trisoup;

TEST_CASE("http: on loopback only names of loopback are answered, elsewhere addresses and this machine", "[http]") {
  for (const char* host : {"127.0.0.1", "127.0.0.1:8000", "localhost", "LOCALHOST:1", "[::1]:80"}) {
    CHECK(web::names_this_server(host, true, "box"));
    CHECK(web::names_this_server(host, false, "box"));
  }
  for (const char* host : {"10.0.0.7:8000", "[fe80::1]", "box", "box.local:8000", "BOX.lan"}) {
    CHECK_FALSE(web::names_this_server(host, true, "box"));
    CHECK(web::names_this_server(host, false, "box"));
  }
  for (const char* host :
       {"", ":80", "evil.example", "127.0.0.1.evil.example", "boxer", "box2.lan", "[", "1.2.3", "::1"})
    for (const bool loopback : {true, false}) {
      CAPTURE(host);
      CHECK_FALSE(web::names_this_server(host, loopback, "box"));
    }
  CHECK_FALSE(web::names_this_server("", false, ""));
  CHECK(web::names_this_server("box", false, "box.example.org"));
}

TEST_CASE("http: an origin is that of the page itself, with the same port", "[http]") {
  CHECK(web::is_own_origin("http://127.0.0.1:8000", "127.0.0.1:8000"));
  CHECK(web::is_own_origin("http://LocalHost:8000", "localhost:8000"));
  for (const char* origin : {"", "null", "https://127.0.0.1:8000", "http://127.0.0.1:8001", "http://127.0.0.1",
                             "http://127.0.0.1:8000.evil.example", "http://evil.example"})
    CHECK_FALSE(web::is_own_origin(origin, "127.0.0.1:8000"));
  CHECK_FALSE(web::is_own_origin("http://", ""));
}

TEST_CASE("http: a path begins with the whole token", "[http]") {
  const auto rest = [](std::string_view path, std::string_view token) {
    return web::take_token(path, token) ? "yes " + std::string(path) : "no";
  };
  CHECK(rest("/", "") == "yes ");
  CHECK(rest("/model.glb", "") == "yes model.glb");
  CHECK(rest("/abc/model.glb", "abc") == "yes model.glb");
  CHECK(rest("/abc/", "abc") == "yes ");
  for (const char* path : {"", "/", "abc/", "/abc", "/ab/", "/abcd/", "/abd/x", "//abc/"})
    CHECK(rest(path, "abc") == "no");
}

TEST_CASE("http: tokens have 22 letters and differ", "[http]") {
  std::set<std::string> tokens;
  for (int i = 0; i < 100; ++i) tokens.insert(web::random_token());
  CHECK(tokens.size() == 100);
  for (const std::string& token : tokens) CHECK(token.size() == 22);
}

TEST_CASE("http: numbers in a query", "[http]") {
  CHECK(web::number_in_query("from=12", "from", 7) == 12);
  CHECK(web::number_in_query("a=1&from=12&b", "from", 7) == 12);
  for (const char* query :
       {"", "from", "from=", "from=-1", "from=x", "from=1x", "xfrom=3", "from=99999999999999999999"})
    CHECK(web::number_in_query(query, "from", 7) == 7);
}
