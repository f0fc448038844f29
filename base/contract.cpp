#include "base/contract.h"

#include <atomic>
#include <cstdio>
#include <cstdlib>

namespace qduino {
namespace {
std::atomic<ContractHandler> installed{nullptr};
}

ContractHandler set_contract_handler(ContractHandler handler) {
    return installed.exchange(handler, std::memory_order_acq_rel);
}

void contract_broken(const char* condition, const char* file, int line) {
    if (ContractHandler handler = installed.load(std::memory_order_acquire)) handler(condition, file, line);
    std::fprintf(stderr, "%s:%d: contract broken: %s\n", file, line, condition);
    std::abort();
}

}  // namespace qduino
