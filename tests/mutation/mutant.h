// Lets one build contain many broken lines, each next to its original; the environment selects one of the two at start.
// tests/mutation/run includes this header in the files that it breaks, in its own copy of the sources.
//
//   RAPID_MUTANT=17          runs the broken line 17; all others run in their original form
//   RAPID_MUTANT_REACHED     a file with one byte for each line, which becomes 1 when the line is executed
#ifndef RAPID_TESTS_MUTATION_MUTANT_H
#define RAPID_TESTS_MUTATION_MUTANT_H

#include <fcntl.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cstdlib>

// A broken line may compare or index in ways that the compiler warns about.
#pragma GCC diagnostic ignored "-Warray-bounds"
#pragma GCC diagnostic ignored "-Wbool-compare"
#pragma GCC diagnostic ignored "-Wparentheses"
#pragma GCC diagnostic ignored "-Wsign-compare"
#pragma GCC diagnostic ignored "-Wtautological-compare"
#pragma GCC diagnostic ignored "-Wtype-limits"

namespace rapid_mutation {

struct Choice {
    long chosen = -1;
    unsigned char* reached = nullptr;  // mapped, because a sandbox may refuse files later

    Choice()
    {
        if (const char* number = std::getenv("RAPID_MUTANT")) chosen = std::atol(number);
        const char* path = std::getenv("RAPID_MUTANT_REACHED");
        const int file = path ? open(path, O_RDWR | O_CLOEXEC) : -1;
        if (file == -1) return;
        struct stat status {};
        if (fstat(file, &status) == 0) {
            void* bytes = mmap(nullptr, status.st_size, PROT_READ | PROT_WRITE, MAP_SHARED, file, 0);
            if (bytes != MAP_FAILED) reached = static_cast<unsigned char*>(bytes);
        }
        close(file);
    }
};

[[gnu::visibility("hidden")]] inline const Choice& choice()
{
    static const Choice made;
    return made;
}

// Read at start, before a program gives up access to files.
[[gnu::visibility("hidden")]] inline const bool is_read = (choice(), true);

}  // namespace rapid_mutation

[[gnu::visibility("hidden")]] inline bool rapid_mutant(long number)
{
    const rapid_mutation::Choice& choice = rapid_mutation::choice();
    if (choice.reached) choice.reached[number] = 1;
    return choice.chosen == number;
}

#endif
