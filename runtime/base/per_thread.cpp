#include "runtime/base/per_thread.h"

#include <pthread.h>

#include <new>
#include <system_error>

namespace rapid {
namespace {

// Returns the key of the list of objects that a thread keeps, latest first.
pthread_key_t thread_objects_key()
{
    static const pthread_key_t key = [] {
        pthread_key_t made = 0;
        const int error = ::pthread_key_create(&made, [](void* object) { delete static_cast<ThreadObject*>(object); });
        if (error != 0) throw std::system_error(error, std::generic_category(), "the values of threads");
        return made;
    }();
    return key;
}

}  // namespace

void keep_until_thread_ends(std::unique_ptr<ThreadObject> object)
{
    const pthread_key_t key = thread_objects_key();
    auto* const earlier = static_cast<ThreadObject*>(::pthread_getspecific(key));
    if (::pthread_setspecific(key, object.get()) != 0) throw std::bad_alloc();
    object->earlier.reset(earlier);
    object.release();
}

}  // namespace rapid
