// The number of threads that a run uses: TBB's workers and the calling thread together.
#pragma once

#include <tbb/global_control.h>
#include <tbb/info.h>
#include <tbb/task_arena.h>

namespace rapid {

class Threads {
public:
    // count: number of threads; 0 means one per processor of the machine. Larger counts are honoured, too, so that
    // tests can show their effects.
    explicit Threads(int count)
        : count_(count > 0 ? count : tbb::info::default_concurrency()),
          limit_(tbb::global_control::max_allowed_parallelism, static_cast<std::size_t>(count_)),
          arena_(count_)
    {
    }

    int count() const { return count_; }

    // Runs f with these threads. The limit alone is not enough, because TBB's own arena never has more threads than the
    // machine.
    template <class F>
    auto run(const F& f)
    {
        return arena_.execute(f);
    }

private:
    int count_;
    tbb::global_control limit_;
    tbb::task_arena arena_;
};

}  // namespace rapid
