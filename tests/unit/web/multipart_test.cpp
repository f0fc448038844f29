// The multipart parser: every split of the bytes gives the same parts, and no malformed body is
// taken for a whole one.
#include "web/http/multipart.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <random>

namespace qduino::web::multipart_test {
namespace {

using ::testing::HasSubstr;

struct Part {
    PartHead head;
    std::string data;
    bool ended = false;
};

class Recorder final : public MultipartSink {
  public:
    Result<void> part_begin(const PartHead& head) override {
        parts.push_back({head, "", false});
        return {};
    }
    Result<void> part_data(std::span<const char> bytes) override {
        EXPECT_FALSE(bytes.empty());
        parts.back().data.append(bytes.data(), bytes.size());
        return {};
    }
    Result<void> part_end() override {
        parts.back().ended = true;
        return {};
    }
    std::vector<Part> parts;
};

struct Parsed {
    std::vector<Part> parts;
    Result<void> fed;
    Result<void> finished;
    [[nodiscard]] bool ok() const { return fed.ok() && finished.ok(); }
};

Parsed parse(std::string_view body, std::size_t piece = 1 << 20, std::string_view boundary = "XX") {
    Recorder recorder;
    MultipartParser parser{boundary, recorder};
    Result<void> fed;
    while (!body.empty() && fed.ok()) {
        const std::size_t count = std::min(piece, body.size());
        fed = parser.feed({body.data(), count});
        body.remove_prefix(count);
    }
    return {recorder.parts, fed, parser.finish()};
}

const std::string kBody =
    "preamble\r\n--XX\r\nContent-Disposition: form-data; name=\"print\"\r\n\r\ntrue\r\n--XX \t\r\n"
    "content-disposition: form-data; name=\"file\"; filename=\"a.gcode\"\r\nContent-Type: text/plain\r\n\r\n"
    "G1 X1\r\n--X\r\n--\r\n\r\n-\r\n--XX\r\nContent-Disposition: form-data; "
    "name=\"empty\"\r\n\r\n\r\n--XX--\r\nepilogue";

void expect_body(const Parsed& parsed) {
    ASSERT_TRUE(parsed.ok());
    ASSERT_EQ(parsed.parts.size(), 3u);
    EXPECT_EQ(parsed.parts[0].head.name, "print");
    EXPECT_EQ(parsed.parts[0].data, "true");
    EXPECT_FALSE(parsed.parts[0].head.is_file);
    EXPECT_EQ(parsed.parts[1].head.file_name, "a.gcode");
    EXPECT_EQ(parsed.parts[1].data, "G1 X1\r\n--X\r\n--\r\n\r\n-");
    EXPECT_EQ(parsed.parts[2].data, "");
    for (const Part& part : parsed.parts) EXPECT_TRUE(part.ended);
}

TEST(Multipart, EveryPieceSizeGivesTheSameParts) {
    for (std::size_t piece = 1; piece <= kBody.size(); ++piece) {
        SCOPED_TRACE(piece);
        expect_body(parse(kBody, piece));
        if (testing::Test::HasFatalFailure()) return;
    }
}

TEST(Multipart, EverySplitInTwoAndThreeGivesTheSameParts) {
    for (std::size_t first = 0; first <= kBody.size(); ++first) {
        for (std::size_t second = first; second <= kBody.size(); second += 7) {
            Recorder recorder;
            MultipartParser parser{"XX", recorder};
            const std::string_view body = kBody;
            for (const std::string_view piece :
                 {body.substr(0, first), body.substr(first, second - first), body.substr(second)}) {
                ASSERT_TRUE(parser.feed({piece.data(), piece.size()}).ok());
            }
            ASSERT_TRUE(parser.finish().ok());
            ASSERT_EQ(recorder.parts.size(), 3u);
            ASSERT_EQ(recorder.parts[1].data, "G1 X1\r\n--X\r\n--\r\n\r\n-") << first << " " << second;
        }
    }
}

TEST(Multipart, EveryTruncationIsAnError) {
    const std::size_t whole = kBody.find("--XX--") + 6;
    for (std::size_t length = 0; length < whole; ++length) {
        const Parsed parsed = parse(std::string_view{kBody}.substr(0, length), 13);
        EXPECT_FALSE(parsed.ok()) << length;
    }
}

TEST(Multipart, RandomBinaryDataComesThroughUnchanged) {
    const std::uint64_t seed = 99;
    std::mt19937_64 random{seed};
    for (int round = 0; round < 300; ++round) {
        // Only bytes that make up delimiters: the hardest case for a search that runs across
        // pieces.
        std::string data(random() % 400, ' ');
        for (char& byte : data) byte = "\r\n-Xab"[random() % 6];
        if (data.find("\r\n--XX") != std::string::npos || data.starts_with("--XX")) continue;
        const std::string body =
            "--XX\r\nContent-Disposition: form-data; name=\"f\"\r\n\r\n" + data + "\r\n--XX--";
        if (("\r\n" + data).find("\r\n--XX") != std::string::npos) continue;
        const Parsed parsed = parse(body, 1 + random() % 20);
        ASSERT_TRUE(parsed.ok()) << "seed " << seed << " round " << round;
        ASSERT_EQ(parsed.parts.at(0).data, data) << "seed " << seed << " round " << round;
    }
}

PartHead head_of(const std::string& disposition) {
    const Parsed parsed = parse("--XX\r\nContent-Disposition: " + disposition + "\r\n\r\nx\r\n--XX--");
    EXPECT_TRUE(parsed.ok()) << disposition;
    return parsed.parts.empty() ? PartHead{} : parsed.parts[0].head;
}

TEST(Multipart, ReadsFileNamesAsClientsSendThem) {
    EXPECT_EQ(head_of(R"(form-data; name="file"; filename="a b.gcode")").file_name, "a b.gcode");
    EXPECT_EQ(head_of(R"(form-data; name="file"; filename="say \"hi\".gcode")").file_name,
              R"(say "hi".gcode)");
    EXPECT_EQ(head_of(R"(form-data; name="file"; filename="C:\dir\a.gcode")").file_name, R"(C:\dir\a.gcode)");
    EXPECT_EQ(head_of(R"(form-data; name=file; filename=plain.gcode)").file_name, "plain.gcode");
    EXPECT_EQ(head_of(R"(form-data; name="file"; filename="x"; filename*=UTF-8''%C3%BCber%20%E2%82%AC.gcode)")
                  .file_name,
              "über €.gcode");
    EXPECT_EQ(head_of(R"(form-data; name="file"; filename*=utf-8'de'b.gcode; filename="x")").file_name,
              "b.gcode");
    EXPECT_EQ(head_of(R"(form-data; filename="a;b=c.gcode"; name="file")").file_name, "a;b=c.gcode");
    EXPECT_TRUE(head_of(R"(form-data; name="file"; filename="")").is_file);
}

TEST(Multipart, MalformedBodiesAreRefused) {
    for (const char* bad : {
             "",
             "no boundary at all",
             "--XX",
             "--XXContent-Disposition: form-data; name=\"a\"\r\n\r\nx\r\n--XX--",
             "--XX\r\n\r\nx\r\n--XX--",
             "--XX\r\nContent-Type: text/plain\r\n\r\nx\r\n--XX--",
             "--XX\r\nContent-Disposition: attachment; name=\"a\"\r\n\r\nx\r\n--XX--",
             "--XX\r\nContent-Disposition: form-data\r\n\r\nx\r\n--XX--",
             "--XX\r\nContent-Disposition: form-data; name=\"a\r\n\r\nx\r\n--XX--",
             "--XX\r\nContent-Disposition: form-data; name\r\n\r\nx\r\n--XX--",
             "--XX\r\nContent-Disposition: form-data; name=\"a\"x\r\n\r\nx\r\n--XX--",
             "--XX\r\nContent-Disposition: form-data; name=\"a\"\r\nContent-Disposition: form-data; "
             "name=\"b\"\r\n\r\nx\r\n--XX--",
             "--XX\r\nContent-Disposition: form-data; name=\"f\"; filename*=latin1''x\r\n\r\nx\r\n--XX--",
             "--XX\r\nContent-Disposition: form-data; name=\"f\"; filename*=UTF-8''%zz\r\n\r\nx\r\n--XX--",
             "--XX\r\nno colon\r\n\r\nx\r\n--XX--",
         }) {
        EXPECT_FALSE(parse(bad).ok()) << bad;
        EXPECT_FALSE(parse(bad, 1).ok()) << bad;
    }
}

TEST(Multipart, EverythingIsBounded) {
    std::string many;
    for (int i = 0; i < 40; ++i) many += "--XX\r\nContent-Disposition: form-data; name=\"a\"\r\n\r\nx\r\n";
    EXPECT_EQ(parse(many + "--XX--").fed.error().code, ErrorCode::out_of_range);
    EXPECT_EQ(parse("--XX\r\n" + std::string(20'000, 'h'), 100).fed.error().code, ErrorCode::out_of_range);
    EXPECT_FALSE(parse(std::string(10'000, 'p'), 100).fed.ok()) << "a preamble without end";
    EXPECT_FALSE(parse("--XX" + std::string(1000, ' ')).fed.ok());
}

TEST(Multipart, NothingIsTakenAfterAnError) {
    Recorder recorder;
    MultipartParser parser{"XX", recorder};
    EXPECT_FALSE(parser.feed(std::string_view{"--XX\r\nbroken\r\n\r\n"}).ok());
    EXPECT_FALSE(parser.feed(std::string_view{"--XX--"}).ok());
    EXPECT_FALSE(parser.finish().ok());
}

TEST(Boundary, IsReadFromTheContentType) {
    EXPECT_EQ(*boundary_of("multipart/form-data; boundary=abc"), "abc");
    EXPECT_EQ(*boundary_of("Multipart/Form-Data; charset=x; boundary=\"a b:c\""), "a b:c");
    EXPECT_EQ(boundary_of("application/json").error().code, ErrorCode::unsupported);
    for (const char* bad :
         {"multipart/form-data", "multipart/form-data; boundary=", "multipart/form-data; boundary=\"\"",
          "multipart/form-data; boundary=a\x01", "multipart/form-data; boundary=\"a \"",
          "multipart/form-data; boundary=<script>"}) {
        EXPECT_EQ(boundary_of(bad).error().code, ErrorCode::invalid_argument) << bad;
    }
    EXPECT_FALSE(boundary_of("multipart/form-data; boundary=" + std::string(71, 'a')).ok());
}

}  // namespace
}  // namespace qduino::web::multipart_test
