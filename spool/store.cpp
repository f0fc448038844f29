#include "spool/store.h"

#include <SQLiteCpp/SQLiteCpp.h>
#include <sqlite3.h>

#include <functional>

#include "spool/name_search.h"
#include "spool/store_schema.h"

namespace qduino::spool {

namespace {

constexpr const char* kPutJob = R"sql(
INSERT INTO jobs(id, name, size, sha256, state, hold, copies, copies_done, priority, position, created_s, started_s,
                 ended_s, error, facts, estimated_s, has_layers, has_thumbnail, stopped_line, stopped_layer, stored_bytes)
VALUES(?,?,?,?,?,?,?,?,?,?,?,?,?,?,?,?,?,?,?,?,?)
ON CONFLICT(id) DO UPDATE SET state=excluded.state, hold=excluded.hold, copies=excluded.copies,
  copies_done=excluded.copies_done, priority=excluded.priority, position=excluded.position,
  started_s=excluded.started_s, ended_s=excluded.ended_s, error=excluded.error,
  stopped_line=excluded.stopped_line, stopped_layer=excluded.stopped_layer)sql";

const std::string kJobColumns =
    "SELECT id, name, size, sha256, state, hold, copies, copies_done, priority, position, created_s, "
    "started_s, ended_s, error, facts, estimated_s, has_layers, has_thumbnail, stopped_line, stopped_layer, "
    "stored_bytes FROM jobs WHERE ";

constexpr const char* kRunColumns = "SELECT id, job, session, length, cancel_asked, inspected FROM runs ";

JobState state_of(const std::string& word) {
    for (const JobState state :
         {JobState::queued, JobState::printing, JobState::done, JobState::cancelled, JobState::failed}) {
        if (to_word(state) == word) return state;
    }
    return JobState::failed;
}

// SQLite's integers are signed: sizes and sessions are stored by their bits.
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
    if (!row.getColumn(18).isNull()) job.stopped_line = row.getColumn(18).getInt64();
    if (!row.getColumn(19).isNull()) job.stopped_layer = row.getColumn(19).getInt64();
    job.stored_bytes = unsigned_of(row.getColumn(20).getInt64());
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
    for (const auto& number : {job.stopped_line, job.stopped_layer}) {
        ++at;
        if (number) put.bind(at, *number);  // else it stays NULL
    }
    put.bind(++at, signed_of(job.stored_bytes));
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

std::vector<Job> read_jobs(SQLite::Statement& rows) {
    std::vector<Job> jobs;
    while (rows.executeStep()) jobs.push_back(job_of(rows));
    return jobs;
}

/// SQL function name_holds(name, folded part).
void name_holds_sql(sqlite3_context* context, int, sqlite3_value** values) {
    const auto text = [](sqlite3_value* value) {
        const auto* bytes = reinterpret_cast<const char*>(sqlite3_value_text(value));
        return std::string_view{bytes ? bytes : "",
                                bytes ? static_cast<std::size_t>(sqlite3_value_bytes(value)) : 0};
    };
    sqlite3_result_int(context, name_holds(text(values[0]), text(values[1])) ? 1 : 0);
}

bool is_wanted(SQLite::Database& database, const std::string& sha256, JobId except) {
    SQLite::Statement get{database, "SELECT 1 FROM jobs WHERE sha256=? AND id<>? LIMIT 1"};
    get.bind(1, sha256);
    get.bind(2, except);
    return get.executeStep();
}

template <typename T>
struct GuardedAs {
    using Type = Result<T>;
};
template <typename T>
struct GuardedAs<Result<T>> {
    using Type = Result<T>;
};
/// The return type of `guarded`: a Result, whether the work returns one or not.
template <typename T>
using Guarded = typename GuardedAs<T>::Type;

}  // namespace

struct Store::Database {
    SQLite::Database connection;

    /// Runs `work`, and turns an exception of SQLite into an Error.
    template <typename Work>
    auto guarded(Work&& work) -> Guarded<std::invoke_result_t<Work>> {
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
        // A damaged file must stay as it was found, with its log: somebody may still want to look
        // at it.
        sqlite3_db_config(connection.getHandle(), SQLITE_DBCONFIG_NO_CKPT_ON_CLOSE, 1, nullptr);
        connection.exec("PRAGMA journal_mode=WAL");
        connection.exec("PRAGMA synchronous=FULL");
        connection.exec("PRAGMA foreign_keys=ON");
        connection.createFunction("name_holds", 2, true, nullptr, name_holds_sql, nullptr, nullptr, nullptr);
        if (const Result<void> ready = prepare_schema(connection); !ready.ok()) return ready.error();
        std::unique_ptr<Store> store{new Store{std::move(database)}};
        store->load_totals();
        sqlite3_db_config(connection.getHandle(), SQLITE_DBCONFIG_NO_CKPT_ON_CLOSE, 0, nullptr);
        return store;
    } catch (const SQLite::Exception& exception) {
        Error error = as_error(exception);
        // Tables of another program, say.
        if (error.code == ErrorCode::internal) error.code = ErrorCode::corrupt;
        return error;
    }
}

/// May throw, as SQLite does.
void Store::load_totals() {
    SQLite::Database& connection = database_->connection;
    for (const char* condition : {kEndedCondition, kLiveCondition}) {
        SQLite::Statement rows{connection, "SELECT state, count(*) FROM jobs WHERE " +
                                               std::string{condition} + " GROUP BY state"};
        while (rows.executeStep())
            totals_.counts.of(state_of(rows.getColumn(0).getString())) = rows.getColumn(1).getInt64();
    }
    totals_.stored_bytes = unsigned_of(single_number(
        connection, "SELECT sum(bytes) FROM (SELECT max(stored_bytes) AS bytes FROM jobs GROUP BY sha256)"));
}

Result<StoredState> Store::load() {
    return database_->guarded([&] {
        SQLite::Database& connection = database_->connection;
        StoredState state;
        SQLite::Statement jobs{connection, kJobColumns + kLiveCondition + " ORDER BY id"};
        state.jobs = read_jobs(jobs);
        state.next_job_id =
            single_number(connection, "SELECT seq FROM sqlite_sequence WHERE name='jobs'") + 1;
        state.last_ended = single_number(
            connection, ("SELECT max(position) FROM jobs WHERE " + std::string{kEndedCondition}).c_str());
        state.last_run_id = unsigned_of(single_number(connection, "SELECT max(id) FROM runs"));
        state.active_run = first_run(connection, "WHERE outcome IS NULL");
        state.awaited_report = first_run(
            connection, "WHERE outcome IS NOT NULL AND inspected=1 AND report IS NULL ORDER BY id DESC");
        state.gate.hold_reason = setting(connection, "hold_reason");
        state.gate.bed_occupied = setting(connection, "bed_occupied") == "1";
        state.journal_id = setting(connection, "journal_id");
        state.rebuilding = setting(connection, "rebuilding") == "1";
        return state;
    });
}

Result<std::vector<SessionRecord>> Store::sessions() {
    return database_->guarded([&] {
        std::vector<SessionRecord> found;
        SQLite::Statement rows{database_->connection, "SELECT token_hash, expires_s FROM sessions"};
        while (rows.executeStep())
            found.push_back({rows.getColumn(0).getString(), rows.getColumn(1).getInt64()});
        return found;
    });
}

void Store::erase_job(JobId id, Totals& totals) {
    SQLite::Database& connection = database_->connection;
    SQLite::Statement old{connection, "SELECT state, sha256, stored_bytes FROM jobs WHERE id=?"};
    old.bind(1, id);
    if (!old.executeStep()) return;
    --totals.counts.of(state_of(old.getColumn(0).getString()));
    if (!is_wanted(connection, old.getColumn(1).getString(), id))
        totals.stored_bytes -= unsigned_of(old.getColumn(2).getInt64());
    // The newest run stays: its number must never be given again.
    for (const char* erase :
         {"DELETE FROM jobs WHERE id=?", "UPDATE runs SET report='' WHERE job=?",
          "DELETE FROM runs WHERE job=? AND id < (SELECT max(id) FROM runs) AND outcome IS NOT NULL"}) {
        SQLite::Statement statement{connection, erase};
        statement.bind(1, id);
        statement.exec();
    }
}

void Store::write_job(const Job& job, Totals& totals) {
    SQLite::Database& connection = database_->connection;
    SQLite::Statement old{connection, "SELECT state FROM jobs WHERE id=?"};
    old.bind(1, job.id);
    if (old.executeStep()) {
        --totals.counts.of(state_of(old.getColumn(0).getString()));
    } else if (!is_wanted(connection, job.sha256, job.id)) {
        totals.stored_bytes += job.stored_bytes;
    }
    ++totals.counts.of(job.state);
    put_job(connection, job);
}

void Store::write(const Commit& commit, Totals& totals) {
    SQLite::Database& connection = database_->connection;
    for (const JobId id : commit.jobs.erase) erase_job(id, totals);
    for (const Job& job : commit.jobs.put) write_job(job, totals);
    if (commit.run_changed) change_run(connection, *commit.run_changed);
    if (commit.run_ended) end_run(connection, *commit.run_ended);
    if (commit.run_begun) begin_run(connection, *commit.run_begun);
    if (commit.gate) {
        put_setting(connection, "hold_reason", commit.gate->hold_reason);
        put_setting(connection, "bed_occupied", commit.gate->bed_occupied ? "1" : "0");
    }
    if (commit.rebuilding) put_setting(connection, "rebuilding", *commit.rebuilding ? "1" : "0");
    if (!commit.report) return;
    SQLite::Statement put{connection, "UPDATE runs SET report=? WHERE id=?"};
    put.bind(1, commit.report->second);
    put.bind(2, signed_of(commit.report->first));
    put.exec();
}

Result<void> Store::commit(const Commit& commit) {
    return database_->guarded([&] {
        // Rolled back if anything below throws.
        SQLite::Transaction transaction{database_->connection};
        Totals totals = totals_;
        write(commit, totals);
        transaction.commit();
        totals_ = totals;
        ++commits_;
    });
}

Result<void> Store::hold_everything(const std::string& reason) {
    return database_->guarded([&] {
        SQLite::Transaction transaction{database_->connection};
        database_->connection.exec(std::string{"UPDATE jobs SET hold=1 WHERE "} + kLiveCondition);
        put_setting(database_->connection, "hold_reason", reason);
        put_setting(database_->connection, "rebuilding", "1");
        transaction.commit();
    });
}

Result<Job> Store::find(JobId id) {
    return database_->guarded([&]() -> Result<Job> {
        SQLite::Statement get{database_->connection, kJobColumns + "id=?"};
        get.bind(1, id);
        if (!get.executeStep()) return no_such_job();
        return job_of(get);
    });
}

Result<std::vector<Job>> Store::ended(const EndedQuery& query) {
    std::string condition = kEndedCondition;
    std::string words;
    for (const JobState state : query.states)
        words += (words.empty() ? "'" : ",'") + std::string{to_word(state)} + "'";
    if (!query.states.empty()) condition += " AND state IN (" + words + ")";
    if (query.below_order) condition += " AND position < ?1";
    if (!query.text.empty()) condition += " AND name_holds(name, ?2)";
    return database_->guarded([&] {
        SQLite::Statement rows{database_->connection,
                               kJobColumns + condition + " ORDER BY position DESC LIMIT ?3"};
        if (query.below_order) rows.bind(1, *query.below_order);
        if (!query.text.empty()) rows.bind(2, folded(query.text));
        rows.bind(3, signed_of(query.limit));
        return read_jobs(rows);
    });
}

Result<std::vector<Job>> Store::oldest_ended(std::size_t limit, UnixSeconds until_s) {
    return database_->guarded([&] {
        SQLite::Statement rows{database_->connection,
                               kJobColumns + kEndedCondition + " AND ended_s<=? ORDER BY position LIMIT ?"};
        rows.bind(1, until_s);
        rows.bind(2, signed_of(limit));
        return read_jobs(rows);
    });
}

Result<bool> Store::blob_wanted(const std::string& sha256, JobId except) {
    return database_->guarded([&] { return is_wanted(database_->connection, sha256, except); });
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
