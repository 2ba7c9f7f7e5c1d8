// Counts the heap allocations of the test program, for tests that promise a function makes none.
// Linking allocation_count.cc replaces the global operator new of the whole program, which can be
// done once only: so every test of this folder counts here.
#pragma once

namespace gravitas::test {

// Calls of operator new by any thread since the program started; 0 under sanitizers.
long allocation_count();

}  // namespace gravitas::test
