// The whole service without sockets and threads: requests as text in, answers as text out. Tasks
// run at once, in order.
#pragma once

#include <deque>
#include <fstream>
#include <nlohmann/json.hpp>
#include <string>

#include "tests/unit/spool/spool_fixture.h"
#include "web/connection.h"
#include "web/net/key_file.h"
#include "web/net/prometheus_metrics.h"
#include "web/net/qr_code.h"
#include "web/one_thread.h"
#include "web/publisher.h"

namespace qduino::web {

/// Takes any text for G-code but "not gcode", and finds the word `bad` a violation at its line.
/// What is only `unhomed` it reads to its end, for the prologue.
class TestReading final : public spool::FileReading {
  public:
    TestReading(ByteSink& layers, double estimated_s) : layers_(layers), estimated_s_(estimated_s) {}

    std::optional<spool::Analysis> feed(std::span<const char> bytes) override {
        text_.append(bytes.data(), bytes.size());
        for (std::size_t end = 0; (end = text_.find('\n')) != std::string::npos; text_.erase(0, end + 1))
            if (on_line(text_.substr(0, end))) return refusal_;
        return std::nullopt;
    }
    Result<spool::Analysis> finish() override {
        on_line(text_);
        if (refusal_) return *refusal_;
        spool::Analysis analysis;
        if (homes_) return analysis;
        QDUINO_TRY(layers_.write(std::string_view{"AAABBBBB"}));
        analysis.layers_json = R"([{"index":0,"bytes":3},{"index":1,"bytes":5}])";
        analysis.facts_json = R"({"layers":2,"estimated_s":100})";
        analysis.estimated_s = estimated_s_;
        analysis.thumbnail = "\x89PNG";
        return analysis;
    }

  private:
    /// True when the refusal stands, whatever follows.
    bool on_line(const std::string& line) {
        using Verdict = spool::Analysis::Verdict;
        ++number_;
        if (homes_ || line.starts_with("homes")) {
            homes_ = true;
        } else if (line.starts_with("not gcode")) {
            refuse(Verdict::not_gcode, "This is no G-code.");
        } else if (line.starts_with("bad")) {
            refuse(Verdict::violation, "too hot");
        } else if (line.starts_with("unhomed") && !refusal_) {
            refuse(Verdict::violation, "nothing has homed it");
            refusal_->prologue = "homes\n";
            return false;
        } else {
            return false;
        }
        return refusal_.has_value();
    }
    void refuse(spool::Analysis::Verdict verdict, const std::string& message) {
        refusal_.emplace();
        refusal_->verdict = verdict;
        refusal_->message = message;
        refusal_->line = verdict == spool::Analysis::Verdict::violation ? number_ : 0;
    }

    ByteSink& layers_;
    double estimated_s_;
    std::string text_;
    std::uint64_t number_ = 0;
    bool homes_ = false;
    std::optional<spool::Analysis> refusal_;
};

class TestAnalyzer final : public spool::Analyzer {
  public:
    std::unique_ptr<spool::FileReading> begin(ByteSink& layers) override {
        return std::make_unique<TestReading>(layers, estimated_s);
    }

    double estimated_s = 100;  ///< of every file; 0: none
};

/// An answer, taken apart.
struct Answer {
    int status = 0;
    std::string head;
    std::string body;
    [[nodiscard]] nlohmann::json json() const { return nlohmann::json::parse(body, nullptr, false); }
    [[nodiscard]] std::string error_code() const { return json()["error"].value("code", ""); }
    [[nodiscard]] std::string header(const std::string& name) const {
        const std::size_t at = head.find("\r\n" + name + ": ");
        if (at == std::string::npos) return {};
        const std::size_t begin = at + name.size() + 4;
        return head.substr(begin, head.find("\r\n", begin) - begin);
    }
};

class WebTest : public spool::SpoolTest {
  protected:
    static constexpr const char* kKey = "0123456789abcdefghijklmnopqrstuvwxyzABCDEFG";

    void SetUp() override {
        SpoolTest::SetUp();
        open_service();
    }
    void TearDown() override {
        connection_.reset();
        service_.reset();
        SpoolTest::TearDown();
    }

    void open_service(std::string key = kKey) {
        connection_.reset();
        service_.reset();
        disk_.limits.size_max_bytes = 1 << 20;
        open_spool();
        printer::MachineConfig machine;
        machine.name.assign("Test printer");
        machine.nozzle_diameter = Millimetres{0.6};
        machine.minimum_extrude = Celsius{180};
        api::Context context{*spool_, machine, R"({"name":"Test printer"})", "1", {}};
        context.metrics = &metrics_;
        context.qr_code = qr_code_of;
        service_ = std::make_unique<Service>(
            ServiceOptions{HostPolicy{{"printer.local"}}, 4, Proxies{{"127.0.0.9"}}}, std::move(context),
            Authenticator{std::move(key), *spool_->store().sessions(), random_token}, StaticFiles{},
            analyzer_, thread_.executors());
    }
    Moment moment() const { return {now_, 1'700'000'000 + to_ns(now_) / 1'000'000'000}; }

    void connect(std::string remote = "127.0.0.1") {
        connection_ = std::make_shared<Connection>(
            *service_, Peer{std::move(remote), secure_}, [] {}, moment());
    }
    /// Everything that comes out when all of it is taken at once; files are read.
    std::string output() {
        std::string text;
        while (auto next = connection_->take_output()) {
            text += next->bytes + next->body;
            if (next->shared) text += *next->shared;
            if (next->file) text += read(*next->file);
            connection_->sent(moment());
        }
        return text;
    }
    static std::string read(const FileRange& range) {
        std::string bytes(range.length, '\0');
        bytes.resize(range.bytes->read_at(range.offset, bytes).value());
        return bytes;
    }
    static Answer parse(const std::string& text) {
        Answer answer;
        const std::size_t end = text.find("\r\n\r\n");
        if (end == std::string::npos || text.size() < 12) return answer;
        answer.status = std::stoi(text.substr(9, 3));
        answer.head = text.substr(0, end + 2);
        answer.body = text.substr(end + 4);
        return answer;
    }
    /// One request on a connection of its own.
    Answer send(const std::string& text, const std::string& remote = "127.0.0.1") {
        connect(remote);
        connection_->receive(text, moment());
        return parse(output());
    }
    /// With the key, and with a Content-Length when there is a body.
    Answer request(const std::string& line, const std::string& body = "", const std::string& headers = "") {
        return send(line + " HTTP/1.1\r\nHost: localhost\r\nX-Api-Key: " + kKey + "\r\n" + headers +
                    (body.empty() ? "" : "Content-Length: " + std::to_string(body.size()) + "\r\n") + "\r\n" +
                    body);
    }
    static std::string multipart(const std::string& name, const std::string& content,
                                 const std::map<std::string, std::string>& fields = {}) {
        std::string body;
        for (const auto& [field, value] : fields) {
            body += "--XX\r\nContent-Disposition: form-data; name=\"" + field + "\"\r\n\r\n" + value + "\r\n";
        }
        return body + "--XX\r\nContent-Disposition: form-data; name=\"file\"; filename=\"" + name +
               "\"\r\nContent-Type: application/octet-stream\r\n\r\n" + content + "\r\n--XX--\r\n";
    }
    static constexpr const char* kMultipart = "Content-Type: multipart/form-data; boundary=XX\r\n";
    Answer upload(const std::string& name, const std::string& content,
                  const std::map<std::string, std::string>& fields = {},
                  const std::string& path = "/api/v1/jobs") {
        return request("POST " + path, multipart(name, content, fields), kMultipart);
    }
    std::size_t files_in(const char* folder) const {
        std::size_t count = 0;
        for (const auto& entry : std::filesystem::directory_iterator{disk_.folder / folder}) {
            count += entry.is_regular_file() ? 1 : 0;
        }
        return count;
    }

    bool secure_ = false;  // connections come by TLS
    TestAnalyzer analyzer_;
    PrometheusMetrics metrics_;
    OneThread thread_;
    std::unique_ptr<Service> service_;
    std::shared_ptr<Connection> connection_;
};

}  // namespace qduino::web
