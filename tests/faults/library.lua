-- Returns the path of the library that tests preload (fault.cpp).
return require("testing.command").binary():match "^(.*)/bin/[^/]*$" .. "/lib/librapid_fault.so"
