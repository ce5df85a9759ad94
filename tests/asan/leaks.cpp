// Disables the leak check in programs with Lua. The pointers in Lua's values are tagged, so the address sanitizer does
// not recognise them, and a process confined by seccomp cannot be stopped for the search.
extern "C" int __lsan_is_turned_off() { return 1; }
