#include "spool/store.h"

#include <SQLiteCpp/SQLiteCpp.h>
#include <sqlite3.h>

#include <functional>

namespace qduino::spool {

namespace {

constexpr int kSchemaVersion = 1;

// The state column holds the words of to_word(): a person with a sqlite shell should be able to read it.
constexpr const char* kSchema = R"sql(
CREATE TABLE IF NOT EXISTS jobs(
  id INTEGER PRIMARY KEY AUTOINCREMENT, name TEXT NOT NULL, size INTEGER NOT NULL, sha256 TEXT NOT NULL,
  state TEXT NOT NULL CHECK(state IN ('queued','printing','done','cancelled','failed')),
  hold INTEGER NOT NULL, copies INTEGER NOT NULL, copies_done INTEGER NOT NULL, priority INTEGER NOT NULL,
  position INTEGER NOT NULL, created_s INTEGER NOT NULL, started_s INTEGER NOT NULL, ended_s INTEGER NOT NULL,
  error TEXT NOT NULL, facts TEXT NOT NULL, estimated_s REAL NOT NULL,
  has_layers INTEGER NOT NULL, has_thumbnail INTEGER NOT NULL) STRICT;
CREATE UNIQUE INDEX IF NOT EXISTS one_prints ON jobs(state) WHERE state = 'printing';
CREATE TABLE IF NOT EXISTS runs(
  id INTEGER PRIMARY KEY, job INTEGER NOT NULL, session INTEGER NOT NULL, length INTEGER NOT NULL,
  cancel_asked INTEGER NOT NULL, inspected INTEGER NOT NULL, outcome TEXT, ended_s INTEGER, report TEXT) STRICT;
CREATE UNIQUE INDEX IF NOT EXISTS one_runs ON runs((1)) WHERE outcome IS NULL;
CREATE INDEX IF NOT EXISTS runs_of_job ON runs(job);
CREATE TABLE IF NOT EXISTS settings(key TEXT PRIMARY KEY, value TEXT NOT NULL) STRICT;
CREATE TABLE IF NOT EXISTS sessions(token_hash TEXT PRIMARY KEY, expires_s INTEGER NOT NULL) STRICT;
)sql";

constexpr const char* kPutJob = R"sql(
INSERT INTO jobs(id, name, size, sha256, state, hold, copies, copies_done, priority, position, created_s, started_s,
                 ended_s, error, facts, estimated_s, has_layers, has_thumbnail)
VALUES(?,?,?,?,?,?,?,?,?,?,?,?,?,?,?,?,?,?)
ON CONFLICT(id) DO UPDATE SET state=excluded.state, hold=excluded.hold, copies=excluded.copies,
  copies_done=excluded.copies_done, priority=excluded.priority, position=excluded.position,
  started_s=excluded.started_s, ended_s=excluded.ended_s, error=excluded.error)sql";

constexpr const char* kJobColumns =
    "SELECT id, name, size, sha256, state, hold, copies, copies_done, priority, position, created_s, "
    "started_s, "
    "ended_s, error, facts, estimated_s, has_layers, has_thumbnail FROM jobs ORDER BY id";

constexpr const char* kRunColumns = "SELECT id, job, session, length, cancel_asked, inspected FROM runs ";

Error as_error(const SQLite::Exception& exception) {
    const int code = exception.getErrorCode();
    FixedString<236> text{"job store: "};
    if (code == SQLITE_FULL) return {ErrorCode::unavailable, text.append("the disk is full")};
    if (code == SQLITE_CORRUPT || code == SQLITE_NOTADB)
        return {ErrorCode::corrupt, text.append(exception.what())};
    if (code == SQLITE_IOERR || code == SQLITE_BUSY || code == SQLITE_CANTOPEN || code == SQLITE_READONLY) {
        return {ErrorCode::unavailable, text.append(exception.what())};
    }
    return {ErrorCode::internal, text.append(exception.what())};
}

JobState state_of(const std::string& word) {
    for (const JobState state :
         {JobState::queued, JobState::printing, JobState::done, JobState::cancelled, JobState::failed}) {
        if (to_word(state) == word) return state;
    }
    return JobState::failed;
}

// SQLite's integers are signed; sizes and sessions are stored by their bits.
std::int64_t signed_of(std::uint64_t value) { return static_cast<std::int64_t>(value); }
std::uint64_t unsigned_of(std::int64_t value) { return static_cast<std::uint64_t>(value); }

Job job_of(SQLite::Statement& row) {
    Job job;
    job.id = row.getColumn(0).getInt64();
    job.name = row.getColumn(1).getString();
    job.size = unsigned_of(row.getColumn(2).getInt64());
    job.sha256 = row.getColumn(3).getString();
    job.state = state_of(row.getColumn(4).getString());
    job.hold = row.getColumn(5).getInt() != 0;
    job.copies = row.getColumn(6).getInt();
    job.copies_done = row.getColumn(7).getInt();
    job.priority = row.getColumn(8).getInt();
    job.order = row.getColumn(9).getInt64();
    job.created_s = row.getColumn(10).getInt64();
    job.started_s = row.getColumn(11).getInt64();
    job.ended_s = row.getColumn(12).getInt64();
    job.error = row.getColumn(13).getString();
    job.facts_json = row.getColumn(14).getString();
    job.estimated_s = row.getColumn(15).getDouble();
    job.has_layers = row.getColumn(16).getInt() != 0;
    job.has_thumbnail = row.getColumn(17).getInt() != 0;
    return job;
}

Run run_of(SQLite::Statement& row) {
    Run run;
    run.id = unsigned_of(row.getColumn(0).getInt64());
    run.job = row.getColumn(1).getInt64();
    run.session = unsigned_of(row.getColumn(2).getInt64());
    run.length = unsigned_of(row.getColumn(3).getInt64());
    run.cancel_asked = row.getColumn(4).getInt() != 0;
    run.inspected = row.getColumn(5).getInt() != 0;
    return run;
}

void put_job(SQLite::Database& database, const Job& job) {
    SQLite::Statement put{database, kPutJob};
    int at = 0;
    put.bind(++at, job.id);
    put.bind(++at, job.name);
    put.bind(++at, signed_of(job.size));
    put.bind(++at, job.sha256);
    put.bind(++at, std::string{to_word(job.state)});
    put.bind(++at, job.hold ? 1 : 0);
    put.bind(++at, job.copies);
    put.bind(++at, job.copies_done);
    put.bind(++at, job.priority);
    put.bind(++at, job.order);
    put.bind(++at, job.created_s);
    put.bind(++at, job.started_s);
    put.bind(++at, job.ended_s);
    put.bind(++at, job.error);
    put.bind(++at, job.facts_json);
    put.bind(++at, job.estimated_s);
    put.bind(++at, job.has_layers ? 1 : 0);
    put.bind(++at, job.has_thumbnail ? 1 : 0);
    put.exec();
}

void begin_run(SQLite::Database& database, const Run& run) {
    SQLite::Statement put{
        database, "INSERT INTO runs(id, job, session, length, cancel_asked, inspected) VALUES(?,?,?,?,?,?)"};
    put.bind(1, signed_of(run.id));
    put.bind(2, run.job);
    put.bind(3, signed_of(run.session));
    put.bind(4, signed_of(run.length));
    put.bind(5, run.cancel_asked ? 1 : 0);
    put.bind(6, run.inspected ? 1 : 0);
    put.exec();
}

void change_run(SQLite::Database& database, const Run& run) {
    SQLite::Statement put{database, "UPDATE runs SET cancel_asked=?, inspected=? WHERE id=?"};
    put.bind(1, run.cancel_asked ? 1 : 0);
    put.bind(2, run.inspected ? 1 : 0);
    put.bind(3, signed_of(run.id));
    put.exec();
}

void end_run(SQLite::Database& database, const Commit::RunEnd& end) {
    SQLite::Statement put{database, "UPDATE runs SET outcome=?, ended_s=? WHERE id=? AND outcome IS NULL"};
    put.bind(1, end.outcome);
    put.bind(2, end.ended_s);
    put.bind(3, signed_of(end.run));
    put.exec();
}

void put_setting(SQLite::Database& database, const std::string& key, const std::string& value) {
    SQLite::Statement put{
        database, "INSERT INTO settings VALUES(?,?) ON CONFLICT(key) DO UPDATE SET value=excluded.value"};
    put.bind(1, key);
    put.bind(2, value);
    put.exec();
}

std::string setting(SQLite::Database& database, const std::string& key) {
    SQLite::Statement get{database, "SELECT value FROM settings WHERE key=?"};
    get.bind(1, key);
    return get.executeStep() ? get.getColumn(0).getString() : std::string{};
}

std::optional<Run> first_run(SQLite::Database& database, const std::string& condition) {
    SQLite::Statement get{database, kRunColumns + condition};
    if (!get.executeStep()) return std::nullopt;
    return run_of(get);
}

std::int64_t single_number(SQLite::Database& database, const char* query) {
    SQLite::Statement get{database, query};
    return get.executeStep() && !get.getColumn(0).isNull() ? get.getColumn(0).getInt64() : 0;
}

}  // namespace

struct Store::Database {
    SQLite::Database connection;

    /// Runs `work`, turning what SQLite throws into an Error.
    template <typename Work>
    auto guarded(Work&& work) -> Result<std::invoke_result_t<Work>> {
        try {
            if constexpr (std::is_void_v<std::invoke_result_t<Work>>) {
                work();
                return {};
            } else {
                return work();
            }
        } catch (const SQLite::Exception& exception) {
            return as_error(exception);
        }
    }
};

Store::Store(std::unique_ptr<Database> database) : database_(std::move(database)) {}
Store::~Store() = default;

Result<std::unique_ptr<Store>> Store::open(const std::filesystem::path& file) {
    try {
        auto database = std::make_unique<Database>(
            Database{SQLite::Database{file.string(), SQLite::OPEN_READWRITE | SQLite::OPEN_CREATE}});
        SQLite::Database& connection = database->connection;
        connection.setBusyTimeout(5000);
        connection.exec("PRAGMA journal_mode=WAL");
        connection.exec("PRAGMA synchronous=FULL");
        connection.exec("PRAGMA foreign_keys=ON");
        const std::int64_t version = single_number(connection, "PRAGMA user_version");
        if (version > kSchemaVersion) {
            return make_error(ErrorCode::unsupported,
                              "job store: written by a newer version of this program");
        }
        SQLite::Transaction transaction{connection};
        connection.exec(kSchema);
        connection.exec("PRAGMA user_version=" + std::to_string(kSchemaVersion));
        transaction.commit();
        return std::unique_ptr<Store>{new Store{std::move(database)}};
    } catch (const SQLite::Exception& exception) {
        return as_error(exception);
    }
}

Result<StoredState> Store::load() {
    return database_->guarded([&] {
        SQLite::Database& connection = database_->connection;
        StoredState state;
        SQLite::Statement jobs{connection, kJobColumns};
        while (jobs.executeStep()) state.jobs.push_back(job_of(jobs));
        state.next_job_id =
            single_number(connection, "SELECT seq FROM sqlite_sequence WHERE name='jobs'") + 1;
        state.last_run_id = unsigned_of(single_number(connection, "SELECT max(id) FROM runs"));
        state.active_run = first_run(connection, "WHERE outcome IS NULL");
        state.awaited_report = first_run(
            connection, "WHERE outcome IS NOT NULL AND inspected=1 AND report IS NULL ORDER BY id DESC");
        state.gate.hold_reason = setting(connection, "hold_reason");
        state.gate.bed_occupied = setting(connection, "bed_occupied") == "1";
        SQLite::Statement sessions{connection, "SELECT token_hash, expires_s FROM sessions"};
        while (sessions.executeStep()) {
            state.sessions.push_back({sessions.getColumn(0).getString(), sessions.getColumn(1).getInt64()});
        }
        return state;
    });
}

Result<void> Store::commit(const Commit& commit) {
    return database_->guarded([&] {
        SQLite::Database& connection = database_->connection;
        SQLite::Transaction transaction{connection};  // rolled back if anything below throws
        for (const JobId id : commit.jobs.erase) {
            for (const char* erase :
                 {"DELETE FROM jobs WHERE id=?", "UPDATE runs SET report='' WHERE job=?"}) {
                SQLite::Statement statement{connection, erase};
                statement.bind(1, id);
                statement.exec();
            }
        }
        for (const Job& job : commit.jobs.put) put_job(connection, job);
        if (commit.run_changed) change_run(connection, *commit.run_changed);
        if (commit.run_ended) end_run(connection, *commit.run_ended);
        if (commit.run_begun) begin_run(connection, *commit.run_begun);
        if (commit.gate) {
            put_setting(connection, "hold_reason", commit.gate->hold_reason);
            put_setting(connection, "bed_occupied", commit.gate->bed_occupied ? "1" : "0");
        }
        if (commit.report) {
            SQLite::Statement put{connection, "UPDATE runs SET report=? WHERE id=?"};
            put.bind(1, commit.report->second);
            put.bind(2, signed_of(commit.report->first));
            put.exec();
        }
        transaction.commit();
    });
}

Result<std::string> Store::report_of(JobId job) {
    Result<std::string> found = database_->guarded([&] {
        SQLite::Statement get{database_->connection,
                              "SELECT report FROM runs WHERE job=? AND report IS NOT NULL AND report<>'' "
                              "ORDER BY id DESC LIMIT 1"};
        get.bind(1, job);
        return get.executeStep() ? get.getColumn(0).getString() : std::string{};
    });
    if (found.ok() && found->empty())
        return make_error(ErrorCode::not_found, "there is no report of this job");
    return found;
}

Result<void> Store::put_session(const SessionRecord& session) {
    return database_->guarded([&] {
        SQLite::Statement put{database_->connection, "INSERT OR REPLACE INTO sessions VALUES(?,?)"};
        put.bind(1, session.token_hash);
        put.bind(2, session.expires_s);
        put.exec();
    });
}

Result<void> Store::erase_session(const std::string& token_hash) {
    return database_->guarded([&] {
        SQLite::Statement erase{database_->connection, "DELETE FROM sessions WHERE token_hash=?"};
        erase.bind(1, token_hash);
        erase.exec();
    });
}

Result<void> Store::erase_sessions_expired(UnixSeconds now_s) {
    return database_->guarded([&] {
        SQLite::Statement erase{database_->connection, "DELETE FROM sessions WHERE expires_s<=?"};
        erase.bind(1, now_s);
        erase.exec();
    });
}

}  // namespace qduino::spool
