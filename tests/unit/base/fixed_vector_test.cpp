#include "base/fixed_vector.h"

#include <gtest/gtest.h>

#include <random>
#include <vector>

namespace qduino::fixed_vector_test {
namespace {

TEST(FixedVector, RefusesWhenFull) {
    FixedVector<int, 2> items;
    EXPECT_TRUE(items.try_push_back(1));
    EXPECT_TRUE(items.try_push_back(2));
    EXPECT_FALSE(items.try_push_back(3));
    EXPECT_EQ(items.size(), 2u);
    EXPECT_EQ(items.front(), 1);
    EXPECT_EQ(items.back(), 2);
    EXPECT_TRUE(items.full());
    items.clear();
    EXPECT_TRUE(items.empty());
}

TEST(FixedVector, AgreesWithAStdVector) {
    std::mt19937_64 random{11};
    FixedVector<int, 9> items;
    std::vector<int> oracle;
    for (int i = 0; i < 50'000; ++i) {
        const int value = static_cast<int>(random() % 1000);
        const std::size_t at = oracle.empty() ? 0 : random() % oracle.size();
        switch (random() % 5) {
            case 0:
                ASSERT_EQ(items.try_push_back(value), oracle.size() < 9);
                if (oracle.size() < 9) oracle.push_back(value);
                break;
            case 1:
                if (items.full()) break;
                items.insert(at, value);
                oracle.insert(oracle.begin() + static_cast<std::ptrdiff_t>(at), value);
                break;
            case 2:
                if (items.empty()) break;
                items.erase(at);
                oracle.erase(oracle.begin() + static_cast<std::ptrdiff_t>(at));
                break;
            case 3:
                if (items.empty()) break;
                items.pop_back();
                oracle.pop_back();
                break;
            default:
                if (items.full()) break;
                items.push_back(value);
                oracle.push_back(value);
        }
        ASSERT_EQ((std::vector<int>{items.begin(), items.end()}), oracle) << "step " << i;
    }
}

TEST(FixedVectorDeathTest, ContractsHold) {
    FixedVector<int, 2> items;
    EXPECT_DEATH(items.pop_back(), "contract broken");
    EXPECT_DEATH(items.front() = 1, "contract broken");
    EXPECT_DEATH(items.erase(0), "contract broken");
    items.push_back(1);
    EXPECT_DEATH(items[1] = 2, "contract broken");
    EXPECT_DEATH(items.insert(2, 3), "contract broken");
    items.push_back(2);
    EXPECT_DEATH(items.push_back(3), "contract broken");
}

}  // namespace
}  // namespace qduino::fixed_vector_test
