// Purpose: running sums over the threads of a work group. GROUP, its threads, is set by the program.
// Source: Hillis and Steele 1986.

shared uint sums[GROUP];

// Of `own` of this thread and of those before; every thread's stay in `sums`.
uint scanned(uint own) {
    uint thread = gl_LocalInvocationIndex;
    barrier();
    sums[thread] = own;
    barrier();
    for (uint reach = 1u; reach < uint(GROUP); reach *= 2u) {
        uint beside = thread >= reach ? sums[thread - reach] : 0u;
        barrier();
        sums[thread] += beside;
        barrier();
    }
    return sums[thread];
}
