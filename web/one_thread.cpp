#include "web/one_thread.h"

#include <utility>

namespace qduino::web {

Executors OneThread::executors() {
    const Executor here = [this](Task task) { run(std::move(task)); };
    return {here, here, here, here};
}

void OneThread::run(Task task) {
    tasks_.push_back(std::move(task));
    if (tasks_.size() > 1) return;
    while (!tasks_.empty()) {
        tasks_.front()();
        tasks_.pop_front();
    }
}

}  // namespace qduino::web
