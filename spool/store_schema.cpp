#include "spool/store_schema.h"

#include <sodium/randombytes.h>
#include <sqlite3.h>

#include <array>
#include <string>

#include "spool/sha256.h"

namespace qduino::spool {

namespace {

constexpr std::int64_t kSchemaVersion = 2;

// The state column holds the words of to_word(): a person with a sqlite shell should be able to
// read it.
constexpr const char* kSchema1 = R"sql(
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

// Version 2: the place where a job stopped, the size of its files, ended jobs numbered in the order
// they ended, and indexes for reading them a page at a time. For older jobs, only the size of the
// G-code is known.
constexpr const char* kSchema2 = R"sql(
ALTER TABLE jobs ADD COLUMN stopped_line INTEGER;
ALTER TABLE jobs ADD COLUMN stopped_layer INTEGER;
ALTER TABLE jobs ADD COLUMN stored_bytes INTEGER NOT NULL DEFAULT 0;
UPDATE jobs SET stored_bytes = size;
UPDATE jobs SET position = ranked.place FROM (
  SELECT id, row_number() OVER (ORDER BY ended_s, id) AS place FROM jobs WHERE state IN ('done','cancelled','failed')) AS ranked
  WHERE jobs.id = ranked.id;
CREATE INDEX jobs_ended ON jobs(position DESC, state, name, ended_s) WHERE state IN ('done','cancelled','failed');
CREATE INDEX jobs_live ON jobs(state) WHERE state IN ('queued','printing');
CREATE INDEX jobs_of_blob ON jobs(sha256, stored_bytes);
)sql";

std::string random_id() {
    std::array<char, 32> bytes{};
    randombytes_buf(bytes.data(), bytes.size());
    return sha256_of({bytes.data(), bytes.size()}).substr(0, 32);
}

Result<void> check_pages(SQLite::Database& database) {
    SQLite::Statement check{database, "PRAGMA quick_check(1)"};
    const std::string verdict = check.executeStep() ? check.getColumn(0).getString() : "no answer";
    if (verdict == "ok") return {};
    Error error{ErrorCode::corrupt, "job store: damaged: "};
    error.message.append(verdict.substr(0, 120));
    return error;
}

}  // namespace

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

std::int64_t single_number(SQLite::Database& database, const char* query) {
    SQLite::Statement get{database, query};
    return get.executeStep() && !get.getColumn(0).isNull() ? get.getColumn(0).getInt64() : 0;
}

Result<void> prepare_schema(SQLite::Database& database) {
    const std::int64_t version = single_number(database, "PRAGMA user_version");
    if (version > kSchemaVersion) {
        return make_error(ErrorCode::unsupported, "job store: written by a newer version of this program");
    }
    if (version == kSchemaVersion) return check_pages(database);
    if (version > 0) {
        if (const Result<void> sound = check_pages(database); !sound.ok()) return sound;
    }
    SQLite::Transaction transaction{database};
    database.exec(kSchema1);
    database.exec(kSchema2);
    SQLite::Statement name{database, "INSERT OR IGNORE INTO settings VALUES('journal_id', ?)"};
    name.bind(1, random_id());
    name.exec();
    database.exec("PRAGMA user_version=" + std::to_string(kSchemaVersion));
    transaction.commit();
    return {};
}

}  // namespace qduino::spool
