#include "runtime/base/of_thread.h"

#include <pthread.h>

#include <new>
#include <system_error>

namespace rapid {
namespace {

// Returns the key of the list of objects that a thread keeps, latest first.
pthread_key_t key_of_kept()
{
    static const pthread_key_t key = [] {
        pthread_key_t made = 0;
        const int error = ::pthread_key_create(&made, [](void* kept) { delete static_cast<KeptByThread*>(kept); });
        if (error != 0) throw std::system_error(error, std::generic_category(), "the values of threads");
        return made;
    }();
    return key;
}

}  // namespace

void keep_by_thread(std::unique_ptr<KeptByThread> kept)
{
    const pthread_key_t key = key_of_kept();
    auto* const earlier = static_cast<KeptByThread*>(::pthread_getspecific(key));
    if (::pthread_setspecific(key, kept.get()) != 0) throw std::bad_alloc();
    kept->earlier.reset(earlier);
    kept.release();
}

}  // namespace rapid
