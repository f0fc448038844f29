#include "spool/disk/store_schema.h"

#include <sqlite3.h>

#include <string>

#include "spool/disk/sha256.h"

namespace qduino::spool {

namespace {

constexpr std::int64_t kSchemaVersion = 3;

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

// Version 3: how far a stopped job came, to the byte, and what a copy took of the printer's time.
constexpr const char* kSchema3 = R"sql(
ALTER TABLE jobs ADD COLUMN stopped_byte INTEGER;
ALTER TABLE jobs ADD COLUMN printed_s INTEGER;
)sql";

Result<void> check_pages(SQLite::Database& database) {
    SQLite::Statement check{database, "PRAGMA quick_check(1)"};
    const std::string verdict = check.executeStep() ? check.getColumn(0).getString() : "no answer";
    if (verdict == "ok") return {};
    return make_error(ErrorCode::corrupt, "job store: damaged: ", verdict.substr(0, 120));
}

}  // namespace

Error as_error(const SQLite::Exception& exception) {
    switch (exception.getErrorCode()) {
        case SQLITE_FULL:
            return make_error(ErrorCode::unavailable, "job store: the disk is full");
        case SQLITE_CORRUPT:
        case SQLITE_NOTADB:
            return make_error(ErrorCode::corrupt, "job store: ", exception.what());
        case SQLITE_IOERR:
        case SQLITE_BUSY:
        case SQLITE_CANTOPEN:
        case SQLITE_READONLY:
            return make_error(ErrorCode::unavailable, "job store: ", exception.what());
        default:
            return make_error(ErrorCode::internal, "job store: ", exception.what());
    }
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
        QDUINO_TRY(check_pages(database));
    }
    SQLite::Transaction transaction{database};
    if (version < 2) {
        database.exec(kSchema1);
        database.exec(kSchema2);
    }
    database.exec(kSchema3);
    SQLite::Statement name{database, "INSERT OR IGNORE INTO settings VALUES('journal_id', ?)"};
    name.bind(1, random_name());
    name.exec();
    database.exec("PRAGMA user_version=" + std::to_string(kSchemaVersion));
    transaction.commit();
    return {};
}

}  // namespace qduino::spool
