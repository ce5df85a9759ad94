// Leaks are not looked for in programs with Lua: pointers in its values have tags, which the address sanitizer takes
// for other numbers; and a process that seccomp confines can't be stopped for the search.
extern "C" int __lsan_is_turned_off() { return 1; }
