#include "spool/disk/sqlite_store.h"

#include <SQLiteCpp/SQLiteCpp.h>
#include <sqlite3.h>

#include <boost/pfr.hpp>

#include "spool/disk/store_schema.h"
#include "spool/name_search.h"

namespace qduino::spool {

namespace {

// A row's columns stand in the order of the members of Job and Run.
const std::string kJobColumns =
    "id, name, size, sha256, state, hold, copies, copies_done, priority, position, created_s, started_s, "
    "ended_s, error, stopped_line, stopped_layer, stopped_byte, printed_s, facts, estimated_s, has_layers, "
    "has_thumbnail, stored_bytes";
const std::string kRunColumns = "id, job, session, length, cancel_asked, inspected";
static_assert(boost::pfr::tuple_size_v<Job> == 23 && boost::pfr::tuple_size_v<Run> == 6);

const std::string kPutJob = "INSERT INTO jobs(" + kJobColumns + R"sql()
VALUES(?,?,?,?,?,?,?,?,?,?,?,?,?,?,?,?,?,?,?,?,?,?,?)
ON CONFLICT(id) DO UPDATE SET state=excluded.state, hold=excluded.hold, copies=excluded.copies,
  copies_done=excluded.copies_done, priority=excluded.priority, position=excluded.position,
  started_s=excluded.started_s, ended_s=excluded.ended_s, error=excluded.error,
  stopped_line=excluded.stopped_line, stopped_layer=excluded.stopped_layer,
  stopped_byte=excluded.stopped_byte, printed_s=excluded.printed_s)sql";

const std::string kSelectJobs = "SELECT " + kJobColumns + " FROM jobs WHERE ";

JobState state_of(const std::string& word) {
    for (const JobState state :
         {JobState::queued, JobState::printing, JobState::done, JobState::cancelled, JobState::failed}) {
        if (to_word(state) == word) return state;
    }
    return JobState::failed;
}

std::uint64_t unsigned_of(std::int64_t value) { return static_cast<std::uint64_t>(value); }

/// SQLite's integers are signed: sizes and sessions are stored by their bits.
template <typename Value>
void bind(SQLite::Statement& statement, int at, const Value& value) {
    if constexpr (std::is_integral_v<Value>) {
        statement.bind(at, static_cast<std::int64_t>(value));
    } else if constexpr (std::is_same_v<Value, JobState>) {
        statement.bind(at, std::string{to_word(value)});
    } else if constexpr (std::is_same_v<Value, std::optional<std::int64_t>>) {
        if (value) statement.bind(at, *value);  // else it stays NULL
    } else {
        statement.bind(at, value);
    }
}

template <typename Value>
void read(const SQLite::Column& column, Value& value) {
    if constexpr (std::is_same_v<Value, JobState>) {
        value = state_of(column.getString());
    } else if constexpr (std::is_same_v<Value, std::optional<std::int64_t>>) {
        if (!column.isNull()) value = column.getInt64();
    } else if constexpr (std::is_same_v<Value, std::string>) {
        value = column.getString();
    } else if constexpr (std::is_floating_point_v<Value>) {
        value = column.getDouble();
    } else {
        value = static_cast<Value>(column.getInt64());
    }
}

/// A statement with a value for each of its question marks.
template <typename... Values>
SQLite::Statement prepared(SQLite::Database& database, const std::string& sql, const Values&... values) {
    SQLite::Statement statement{database, sql};
    int at = 0;
    (bind(statement, ++at, values), ...);
    return statement;
}

template <typename... Values>
void execute(SQLite::Database& database, const std::string& sql, const Values&... values) {
    prepared(database, sql, values...).exec();
}

/// Writes the members of `record` as one row.
template <typename Record>
void put_row(SQLite::Database& database, const std::string& sql, const Record& record) {
    SQLite::Statement put{database, sql};
    boost::pfr::for_each_field(
        record, [&](const auto& member, std::size_t at) { bind(put, static_cast<int>(at) + 1, member); });
    put.exec();
}

template <typename Record>
std::vector<Record> read_rows(SQLite::Statement rows) {
    std::vector<Record> records;
    while (rows.executeStep()) {
        boost::pfr::for_each_field(records.emplace_back(), [&](auto& member, std::size_t at) {
            read(rows.getColumn(static_cast<int>(at)), member);
        });
    }
    return records;
}

void put_setting(SQLite::Database& database, const std::string& key, const std::string& value) {
    execute(database, "INSERT INTO settings VALUES(?,?) ON CONFLICT(key) DO UPDATE SET value=excluded.value",
            key, value);
}

std::string setting(SQLite::Database& database, const std::string& key) {
    SQLite::Statement get = prepared(database, "SELECT value FROM settings WHERE key=?", key);
    return get.executeStep() ? get.getColumn(0).getString() : std::string{};
}

std::optional<Run> first_run(SQLite::Database& database, const std::string& condition) {
    const auto runs =
        read_rows<Run>({database, "SELECT " + kRunColumns + " FROM runs WHERE " + condition + " LIMIT 1"});
    return runs.empty() ? std::nullopt : std::optional{runs.front()};
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
    return prepared(database, "SELECT 1 FROM jobs WHERE sha256=? AND id<>? LIMIT 1", sha256, except)
        .executeStep();
}

}  // namespace

struct SqliteStore::Database {
    SQLite::Database connection;
    std::function<bool()> make_room = [] { return false; };
    int failed_with = 0;  ///< SQLite's code of the last failure

    /// Runs `work`, and turns an exception of SQLite into an Error. Where the disk was full it is
    /// run once more, when room can be made.
    template <typename Value, typename Work>
    Result<Value> guarded(Work&& work) {
        Result<Value> done = attempted<Value>(work);
        // A full disk shows as an error of input and output where SQLite grows its log's index. The
        // connection itself does not know any more: a transaction has been rolled back since.
        const int code = failed_with & 0xff;
        if (done || (code != SQLITE_FULL && code != SQLITE_IOERR) || !make_room()) return done;
        return attempted<Value>(work);
    }
    template <typename Value, typename Work>
    Result<Value> attempted(Work& work) {
        try {
            if constexpr (std::is_void_v<std::invoke_result_t<Work>>) {
                work();
                return {};
            } else {
                return work();
            }
        } catch (const SQLite::Exception& exception) {
            failed_with = exception.getErrorCode();
            return as_error(exception);
        }
    }
};

void SqliteStore::when_full(std::function<bool()> make_room) { database_->make_room = std::move(make_room); }

SqliteStore::SqliteStore(std::unique_ptr<Database> database) : database_(std::move(database)) {}
SqliteStore::~SqliteStore() = default;

Result<std::unique_ptr<SqliteStore>> SqliteStore::open(const std::filesystem::path& file) {
    try {
        auto database = std::make_unique<Database>(
            Database{SQLite::Database{file.string(), SQLite::OPEN_READWRITE | SQLite::OPEN_CREATE},
                     [] { return false; }});
        SQLite::Database& connection = database->connection;
        connection.setBusyTimeout(5000);
        // A damaged file must stay as it was found, with its log: somebody may still want to look
        // at it.
        sqlite3_db_config(connection.getHandle(), SQLITE_DBCONFIG_NO_CKPT_ON_CLOSE, 1, nullptr);
        connection.exec("PRAGMA journal_mode=WAL");
        connection.exec("PRAGMA synchronous=FULL");
        connection.exec("PRAGMA foreign_keys=ON");
        connection.createFunction("name_holds", 2, true, nullptr, name_holds_sql, nullptr, nullptr, nullptr);
        QDUINO_TRY(prepare_schema(connection));
        std::unique_ptr<SqliteStore> store{new SqliteStore{std::move(database)}};
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
void SqliteStore::load_totals() {
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

Result<StoredState> SqliteStore::load() {
    return database_->guarded<StoredState>([&] {
        SQLite::Database& connection = database_->connection;
        StoredState state;
        state.jobs = read_rows<Job>({connection, kSelectJobs + kLiveCondition + " ORDER BY id"});
        state.next_job_id =
            single_number(connection, "SELECT seq FROM sqlite_sequence WHERE name='jobs'") + 1;
        state.last_ended = single_number(
            connection, ("SELECT max(position) FROM jobs WHERE " + std::string{kEndedCondition}).c_str());
        state.last_run_id = unsigned_of(single_number(connection, "SELECT max(id) FROM runs"));
        state.active_run = first_run(connection, "outcome IS NULL");
        state.awaited_report =
            first_run(connection, "outcome IS NOT NULL AND inspected=1 AND report IS NULL ORDER BY id DESC");
        state.gate.hold_reason = setting(connection, "hold_reason");
        state.gate.bed_occupied = setting(connection, "bed_occupied") == "1";
        state.journal_id = setting(connection, "journal_id");
        state.rebuilding = setting(connection, "rebuilding") == "1";
        state.newest_s = single_number(connection, "SELECT max(max(created_s), max(ended_s)) FROM jobs");
        return state;
    });
}

Result<std::vector<SessionRecord>> SqliteStore::sessions() {
    return database_->guarded<std::vector<SessionRecord>>([&] {
        return read_rows<SessionRecord>(
            {database_->connection, "SELECT token_hash, expires_s FROM sessions"});
    });
}

void SqliteStore::erase_job(JobId id, Totals& totals) {
    SQLite::Database& connection = database_->connection;
    SQLite::Statement old =
        prepared(connection, "SELECT state, sha256, stored_bytes FROM jobs WHERE id=?", id);
    if (!old.executeStep()) return;
    --totals.counts.of(state_of(old.getColumn(0).getString()));
    if (!is_wanted(connection, old.getColumn(1).getString(), id))
        totals.stored_bytes -= unsigned_of(old.getColumn(2).getInt64());
    // The newest run stays: its number must never be given again.
    for (const char* erase :
         {"DELETE FROM jobs WHERE id=?", "UPDATE runs SET report='' WHERE job=?",
          "DELETE FROM runs WHERE job=? AND id < (SELECT max(id) FROM runs) AND outcome IS NOT NULL"}) {
        execute(connection, erase, id);
    }
}

void SqliteStore::write_job(const Job& job, Totals& totals) {
    SQLite::Database& connection = database_->connection;
    SQLite::Statement old = prepared(connection, "SELECT state FROM jobs WHERE id=?", job.id);
    if (old.executeStep()) {
        --totals.counts.of(state_of(old.getColumn(0).getString()));
    } else if (!is_wanted(connection, job.sha256, job.id)) {
        totals.stored_bytes += job.stored_bytes;
    }
    ++totals.counts.of(job.state);
    put_row(connection, kPutJob, job);
}

void SqliteStore::write(const Commit& commit, Totals& totals) {
    SQLite::Database& connection = database_->connection;
    for (const JobId id : commit.jobs.erase) erase_job(id, totals);
    for (const Job& job : commit.jobs.put) write_job(job, totals);
    if (const auto& run = commit.run_changed) {
        execute(connection, "UPDATE runs SET cancel_asked=?, inspected=? WHERE id=?", run->cancel_asked,
                run->inspected, run->id);
    }
    if (const auto& end = commit.run_ended) {
        execute(connection, "UPDATE runs SET outcome=?, ended_s=? WHERE id=? AND outcome IS NULL",
                end->outcome, end->ended_s, end->run);
    }
    if (commit.run_begun)
        put_row(connection, "INSERT INTO runs(" + kRunColumns + ") VALUES(?,?,?,?,?,?)", *commit.run_begun);
    if (commit.gate) {
        put_setting(connection, "hold_reason", commit.gate->hold_reason);
        put_setting(connection, "bed_occupied", commit.gate->bed_occupied ? "1" : "0");
    }
    if (commit.rebuilding) put_setting(connection, "rebuilding", *commit.rebuilding ? "1" : "0");
    if (commit.report)
        execute(connection, "UPDATE runs SET report=? WHERE id=?", commit.report->second,
                commit.report->first);
}

Result<void> SqliteStore::commit(const Commit& commit) {
    return database_->guarded<void>([&] {
        // Rolled back if anything below throws.
        SQLite::Transaction transaction{database_->connection};
        Totals totals = totals_;
        write(commit, totals);
        transaction.commit();
        totals_ = totals;
        ++commits_;
    });
}

Result<void> SqliteStore::hold_everything(const std::string& reason) {
    return database_->guarded<void>([&] {
        SQLite::Transaction transaction{database_->connection};
        database_->connection.exec(std::string{"UPDATE jobs SET hold=1 WHERE "} + kLiveCondition);
        put_setting(database_->connection, "hold_reason", reason);
        put_setting(database_->connection, "rebuilding", "1");
        transaction.commit();
    });
}

Result<Job> SqliteStore::find(JobId id) {
    return database_->guarded<Job>([&]() -> Result<Job> {
        std::vector<Job> found = read_rows<Job>(prepared(database_->connection, kSelectJobs + "id=?", id));
        if (found.empty()) return no_such_job();
        return std::move(found.front());
    });
}

Result<std::vector<Job>> SqliteStore::ended(const EndedQuery& query) {
    std::string condition = kEndedCondition;
    std::string words;
    for (const JobState state : query.states)
        words += (words.empty() ? "'" : ",'") + std::string{to_word(state)} + "'";
    if (!query.states.empty()) condition += " AND state IN (" + words + ")";
    if (query.below_order) condition += " AND position < ?1";
    if (!query.text.empty()) condition += " AND name_holds(name, ?2)";
    return database_->guarded<std::vector<Job>>([&] {
        return read_rows<Job>(prepared(database_->connection,
                                       kSelectJobs + condition + " ORDER BY position DESC LIMIT ?3",
                                       query.below_order, folded(query.text), query.limit));
    });
}

Result<std::vector<Job>> SqliteStore::oldest_ended(std::size_t limit, UnixSeconds until_s,
                                                   UnixSeconds from_s) {
    return database_->guarded<std::vector<Job>>([&] {
        return read_rows<Job>(
            prepared(database_->connection,
                     kSelectJobs + kEndedCondition + " AND ended_s BETWEEN ? AND ? ORDER BY position LIMIT ?",
                     from_s, until_s, limit));
    });
}

Result<bool> SqliteStore::blob_wanted(const std::string& sha256, JobId except) {
    return database_->guarded<bool>([&] { return is_wanted(database_->connection, sha256, except); });
}

Result<std::string> SqliteStore::report_of(JobId job) {
    return database_->guarded<std::string>([&]() -> Result<std::string> {
        SQLite::Statement get = prepared(database_->connection,
                                         "SELECT report FROM runs WHERE job=? AND report IS NOT NULL AND "
                                         "report<>'' ORDER BY id DESC LIMIT 1",
                                         job);
        if (!get.executeStep()) return make_error(ErrorCode::not_found, "there is no report of this job");
        return get.getColumn(0).getString();
    });
}

Result<void> SqliteStore::put_session(const SessionRecord& session) {
    return database_->guarded<void>(
        [&] { put_row(database_->connection, "INSERT OR REPLACE INTO sessions VALUES(?,?)", session); });
}

Result<void> SqliteStore::erase_session(const std::string& token_hash) {
    return database_->guarded<void>(
        [&] { execute(database_->connection, "DELETE FROM sessions WHERE token_hash=?", token_hash); });
}

Result<void> SqliteStore::keep_sessions(std::size_t count) {
    return database_->guarded<void>([&] {
        execute(database_->connection,
                "DELETE FROM sessions WHERE token_hash NOT IN "
                "(SELECT token_hash FROM sessions ORDER BY expires_s DESC LIMIT ?)",
                count);
    });
}

}  // namespace qduino::spool
