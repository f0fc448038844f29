#include "board/linux/pin/death_witness.h"

#include <signal.h>

#include <cstddef>

#include "board/linux/kernel/futex.h"
#include "board/linux/kernel/real_time_thread.h"

namespace qduino::board::linux {
namespace {

constexpr int kPriority = 89;  // the loops' highest is 80; the supervisor has 90
constexpr std::size_t kStackBytes = 64 * 1024;

static_assert(kWitnessDied == FUTEX_OWNER_DIED);

}  // namespace

void DeathWitness::call(std::atomic<std::uint32_t>& word, bool real_time) {
    if (word_) return;
    word_ = &word;
    real_time_ = real_time;
    standing_ = 0;
    sigset_t all, before;
    sigfillset(&all);
    // The thread takes no signal of the program.
    ::pthread_sigmask(SIG_SETMASK, &all, &before);
    const auto made = make_thread("the witness", kStackBytes, &DeathWitness::main, this);
    ::pthread_sigmask(SIG_SETMASK, &before, nullptr);
    if (!made) {
        word_ = nullptr;
        return;
    }
    thread_ = *made;
    while (standing_.load() == 0) futex_wait_until(standing_, 0, kForever);
}

void DeathWitness::dismiss() {
    if (!word_) return;
    standing_ = 2;
    futex_wake_all(standing_);
    ::pthread_join(thread_, nullptr);
    word_ = nullptr;
}

void* DeathWitness::main(void* self) {
    static_cast<DeathWitness*>(self)->stand();
    return nullptr;
}

void DeathWitness::stand() {
    name_thread("witness");
    if (real_time_) static_cast<void>(become_real_time(kPriority));
    // A list of one. The kernel walks it when the thread ends, and finds in `word` that it was this
    // thread's. It replaces the C library's list for this thread, which locks nothing.
    robust_list entry{};
    robust_list_head head{};
    head.list.next = &entry;
    entry.next = &head.list;
    head.futex_offset =
        static_cast<long>(reinterpret_cast<std::intptr_t>(word_) - reinterpret_cast<std::intptr_t>(&entry));
    word_->store(static_cast<std::uint32_t>(::syscall(SYS_gettid)));
    ::syscall(SYS_set_robust_list, &head, sizeof head);
    standing_ = 1;
    futex_wake_all(standing_);
    while (standing_.load() != 2) futex_wait_until(standing_, 1, kForever);
    word_->store(0);
    ::syscall(SYS_set_robust_list, nullptr, sizeof head);  // the list's stack frame goes
}

}  // namespace qduino::board::linux
