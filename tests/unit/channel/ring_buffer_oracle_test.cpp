// The ring against a std::deque, on random operations.

#include <gtest/gtest.h>

#include <deque>
#include <random>
#include <vector>

#include "channel/ring_buffer.h"

namespace qduino::channel::ring_buffer_oracle_test {
namespace {

template <std::size_t N>
class Comparison {
  public:
    explicit Comparison(std::uint64_t seed) : random_(seed) {}

    void step() {
        switch (random_() % 11) {
            case 0:
                return push_all();
            case 1:
            case 2:
                return push_some();
            case 3:
            case 4:
                return pop_some();
            case 5:
                return peek();
            case 6:
                return random_() % 20 == 0 ? discard() : peek();
            case 7:
                return adopt();
            case 8:
                return push_one();
            case 9:
                return stage();
            default:
                return pop_one();
        }
    }
    void compare() {
        ASSERT_EQ(ring_.size(), oracle_.size());
        ASSERT_EQ(ring_.free(), N - oracle_.size());
        ASSERT_EQ(ring_.empty(), oracle_.empty());
        ASSERT_EQ(ring_.pushed() - ring_.popped(), oracle_.size());
    }

  private:
    std::vector<int> some() {
        std::vector<int> items(random_() % (N + 3));
        for (int& item : items) item = next_++;
        return items;
    }
    void push_one() {
        const int item = next_++;
        const bool fits = oracle_.size() < N;
        ASSERT_EQ(ring_.try_push(item), fits);
        if (fits) oracle_.push_back(item);
    }
    /// What was not committed was never there.
    void stage() {
        ASSERT_EQ(ring_.try_stage(next_++), oracle_.size() < N);
        ring_.commit(0);
    }
    void push_some() {
        const std::vector<int> items = some();
        const std::size_t count = std::min(items.size(), N - oracle_.size());
        ASSERT_EQ(ring_.push_some(items), count);
        oracle_.insert(oracle_.end(), items.begin(), items.begin() + static_cast<std::ptrdiff_t>(count));
    }
    void push_all() {
        const std::vector<int> items = some();
        const bool fits = items.size() <= N - oracle_.size();
        ASSERT_EQ(ring_.try_push_all(items), fits);
        if (fits) oracle_.insert(oracle_.end(), items.begin(), items.end());
    }
    void pop_one() {
        int item = -1;
        ASSERT_EQ(ring_.try_pop(item), !oracle_.empty());
        if (oracle_.empty()) return;
        ASSERT_EQ(item, oracle_.front());
        oracle_.pop_front();
    }
    void pop_some() {
        std::vector<int> items(random_() % (N + 3), -1);
        const std::size_t count = ring_.pop_some(items);
        ASSERT_EQ(count, std::min(items.size(), oracle_.size()));
        for (std::size_t i = 0; i < count; ++i) {
            ASSERT_EQ(items[i], oracle_.front());
            oracle_.pop_front();
        }
    }
    void peek() {
        const std::size_t ahead = random_() % (N + 1);
        const int* item = ring_.peek(ahead);
        ASSERT_EQ(item != nullptr, ahead < oracle_.size());
        if (item) {
            ASSERT_EQ(*item, oracle_[ahead]);
        }
    }
    void discard() {
        ring_.discard_all();
        oracle_.clear();
    }
    void adopt() {
        ring_.adopt_writer();
        ring_.adopt_reader();
    }

    std::mt19937_64 random_;
    RingBuffer<int, N> ring_;
    std::deque<int> oracle_;
    int next_ = 0;
};

template <std::size_t N>
void compare_for(int steps) {
    for (std::uint64_t seed = 1; seed <= 20; ++seed) {
        Comparison<N> comparison{seed};
        for (int i = 0; i < steps; ++i) {
            comparison.step();
            comparison.compare();
            ASSERT_FALSE(::testing::Test::HasFatalFailure()) << "seed " << seed << ", step " << i;
        }
    }
}

TEST(RingBufferOracle, OneSlot) { compare_for<1>(3000); }
TEST(RingBufferOracle, FewSlots) { compare_for<4>(5000); }
TEST(RingBufferOracle, ManySlots) { compare_for<64>(5000); }

}  // namespace
}  // namespace qduino::channel::ring_buffer_oracle_test
