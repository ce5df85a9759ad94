// Declares to the thread sanitizer the ordering that oneTBB establishes.
//
// Debian's libtbb is not instrumented, so the sanitizer does not see the atomics by which a task begins after it was
// spawned, a loop returns after its last task, and a task's memory is reused by the next one. This file replaces the
// functions that the library exports for its header templates by ones that declare the ordering and then call the
// originals. Without it, every parallel loop would look like a race. If these reports were suppressed, no race in a
// loop would be found.
#include <dlfcn.h>
#include <oneapi/tbb/detail/_small_object_pool.h>
#include <oneapi/tbb/detail/_task.h>
#include <sanitizer/tsan_interface.h>

#include <cstdlib>
#include <new>

namespace tbb::detail {

// Wraps a spawned task, so that it begins after the spawning.
class OrderedTask final : public d1::task {
public:
    explicit OrderedTask(d1::task& task) : task_(task) { __tsan_release(this); }

    d1::task* execute(d1::execution_data& data) override
    {
        __tsan_acquire(this);
        d1::task* next = task_.execute(data);  // if it throws, the library calls cancel() next
        delete this;
        return next;
    }
    d1::task* cancel(d1::execution_data& data) override
    {
        __tsan_acquire(this);
        d1::task* next = task_.cancel(data);
        delete this;
        return next;
    }

private:
    d1::task& task_;
};

namespace {

// The library's own function of this name.
template <class... Arguments>
auto library_function(const char* name) -> void (*)(Arguments...)
{
    void* found = dlsym(RTLD_NEXT, name);
    if (!found) std::abort();
    return reinterpret_cast<void (*)(Arguments...)>(found);
}

// The last task of a loop counts the references of its wait_context down to 0 in a header, which the sanitizer sees.
// The waiting thread reads them inside the library.
void acquire_end(d1::wait_context& context)
{
    auto* words = reinterpret_cast<std::uint64_t*>(&context);
    for (std::size_t i = 0; i < sizeof context / sizeof *words; ++i) __tsan_acquire(words + i);
}

void* aligned(std::size_t bytes)
{
    constexpr std::size_t line = 128;
    void* memory = std::aligned_alloc(line, (bytes + line - 1) / line * line);
    if (!memory) throw std::bad_alloc();
    return memory;
}

}  // namespace

namespace r1 {

void spawn(d1::task& task, d1::task_group_context& context)
{
    static const auto real = library_function<d1::task&, d1::task_group_context&>(
        "_ZN3tbb6detail2r15spawnERNS0_2d14taskERNS2_18task_group_contextE");
    real(*new OrderedTask(task), context);
}

void spawn(d1::task& task, d1::task_group_context& context, d1::slot_id slot)
{
    static const auto real = library_function<d1::task&, d1::task_group_context&, d1::slot_id>(
        "_ZN3tbb6detail2r15spawnERNS0_2d14taskERNS2_18task_group_contextEt");
    real(*new OrderedTask(task), context, slot);
}

void execute_and_wait(d1::task& task, d1::task_group_context& context, d1::wait_context& end,
                      d1::task_group_context& waiting)
{
    static const auto real =
        library_function<d1::task&, d1::task_group_context&, d1::wait_context&, d1::task_group_context&>(
            "_ZN3tbb6detail2r116execute_and_waitERNS0_2d14taskERNS2_18task_group_contextERNS2_12wait_contextES6_");
    struct Acquire {
        d1::wait_context& end;
        ~Acquire() { acquire_end(end); }
    } const acquire{end};  // also if a task has thrown
    real(task, context, end, waiting);
}

void wait(d1::wait_context& end, d1::task_group_context& context)
{
    static const auto real = library_function<d1::wait_context&, d1::task_group_context&>(
        "_ZN3tbb6detail2r14waitERNS0_2d112wait_contextERNS2_18task_group_contextE");
    struct Acquire {
        d1::wait_context& end;
        ~Acquire() { acquire_end(end); }
    } const acquire{end};
    real(end, context);
}

// Allocates the memory of tasks and containers with an allocator that the sanitizer knows.
void* allocate(d1::small_object_pool*& pool, std::size_t bytes)
{
    static char none;
    pool = reinterpret_cast<d1::small_object_pool*>(&none);
    return aligned(bytes);
}
void* allocate(d1::small_object_pool*& pool, std::size_t bytes, const d1::execution_data&)
{
    return allocate(pool, bytes);
}
void deallocate(d1::small_object_pool&, void* memory, std::size_t) { std::free(memory); }
void deallocate(d1::small_object_pool&, void* memory, std::size_t, const d1::execution_data&) { std::free(memory); }

void* cache_aligned_allocate(std::size_t bytes) { return aligned(bytes); }
void cache_aligned_deallocate(void* memory) { std::free(memory); }
void* allocate_memory(std::size_t bytes) { return aligned(bytes); }
void deallocate_memory(void* memory) { std::free(memory); }

}  // namespace r1
}  // namespace tbb::detail
