// The whole service where there is no disk: as on one, but nothing is durable, and files that find
// no memory are refused.
#include <gtest/gtest.h>

#include "spool/memory_storage.h"
#include "tests/unit/web/web_fixture.h"

namespace qduino::web::memory_service_test {
namespace {

class MemoryServiceTest : public WebTest {
  protected:
    std::unique_ptr<spool::Storage> make_storage() override {
        auto storage = std::make_unique<spool::MemoryStorage>(
            spool::MemoryFiles::Limits{.places = 2, .file_bytes_max = 1000, .layers_bytes_max = 100});
        storage->files().when_full([this] { return spool_->erase_oldest().ok(); });
        return storage;
    }
};

TEST_F(MemoryServiceTest, AFileIsTakenAndGivenBackWithItsLayers) {
    const Answer made = upload("a.gcode", "G28\nG1 X1\n");
    ASSERT_EQ(made.status, 201);
    EXPECT_EQ(made.json()["facts"]["layers"], 2);
    EXPECT_EQ(request("GET /api/v1/jobs/1/file").body, "G28\nG1 X1\n");
    EXPECT_EQ(request("GET /api/v1/jobs/1/layers/1").body, "BBBBB");
    EXPECT_EQ(request("GET /api/v1/jobs/1/thumbnail").body, "\x89PNG");
    const auto list = request("GET /api/v1/jobs").json();
    EXPECT_EQ(list["jobs"].size(), 1u);
    EXPECT_EQ(list["queue"]["durable"], false);
    EXPECT_EQ(request("DELETE /api/v1/jobs/1").status, 204);
    EXPECT_EQ(request("GET /api/v1/jobs/1/file").status, 404);
}

TEST_F(MemoryServiceTest, ANewFileTakesThePlaceOfTheJobThatEndedFirst) {
    start_sketch();
    run(2);
    for (const char* name : {"a", "b"}) {
        ASSERT_EQ(upload(name, name, {{"print", "true"}}).status, 201);
        run(20);
    }
    ASSERT_EQ(spool_->counts().done, 2);
    ASSERT_EQ(upload("c", "c").status, 201);
    EXPECT_FALSE(spool_->find(1)) << "its file had to go, and the job with it";
    EXPECT_EQ(request("GET /api/v1/jobs/2/file").body, "b");
    ASSERT_EQ(upload("d", "d").status, 201);
    const Answer refused = upload("e", "e");
    EXPECT_EQ(refused.status, 507);
    EXPECT_EQ(refused.error_code(), "unavailable");
    EXPECT_EQ(request("GET /api/v1/jobs/3/file").body, "c");
}

TEST_F(MemoryServiceTest, NothingPrintsBeforeSomebodyHasLookedAtTheBed) {
    options_.confirm_bed = true;
    open_service();
    start_sketch();
    ASSERT_EQ(upload("a", "a", {{"print", "true"}}).status, 201);
    run(20);
    EXPECT_EQ(state(1), spool::JobState::queued);
    EXPECT_EQ(request("POST /api/v1/machine/bed-cleared").status, 202);
    run(20);
    EXPECT_EQ(state(1), spool::JobState::done);
}

}  // namespace
}  // namespace qduino::web::memory_service_test
