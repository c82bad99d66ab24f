// Distribution of a texture's vectors over threads, for loops that process each vector independently.
#ifdef LANES_OF_A_CPU
// A lane handles one component, so that adjacent lanes access adjacent words. There are as many threads as lanes, so
// that no thread waits at barriers.
#define THREADS LANES_OF_A_CPU
const uint kNumbers = 1u;  // per element
#define FLOATS float
#define UINTS uint
#define NUMBER(element, c) element
#define ELEMENT(vectors, first, e) vectors[(first) + ((e) >> 2)][(e)&3u]
#define ELEMENT_OF(i, count) ((i)*THREADS + thread)
#define SHARED_VECTORS(word, vector, name, count) SHARED word name[(count)*4u]
#define SHARED_ELEMENT(vectors, e) vectors[e]
#define SHARED_WORD(vectors, i, c) vectors[(i)*4u + (c)]
#else
// A thread handles a vector. Eight neighbouring threads handle eight adjacent vectors and then continue with the next
// ones: full cache lines on a GPU, one memory stream for a driver that runs eight threads as one.
#ifndef THREADS
#define THREADS 64u
#endif
const uint kNumbers = 4u;
#define FLOATS vec4
#define UINTS uvec4
#define NUMBER(element, c) element[c]
#define ELEMENT(vectors, first, e) vectors[(first) + (e)]
#define ELEMENT_OF(i, count) ((thread / 8u * ELEMENT_STEPS(count) + (i)) * 8u + thread % 8u)
#define SHARED_VECTORS(word, vector, name, count) SHARED vector name[count]
#define SHARED_ELEMENT(vectors, e) vectors[e]
#define SHARED_WORD(vectors, i, c) vectors[i][c]
#endif
const uint kElements = 8u / kNumbers;  // per sample: features 0..6 and opacity
/// ELEMENT(vectors, first, e): element e in memory, counted from vector `first`. SHARED_ELEMENT(vectors, e): element e
/// in shared memory. SHARED_WORD(vectors, i, c): component c of vector i in shared memory. The elements of a thread are
/// ELEMENT_OF(i, count) for i < ELEMENT_STEPS(count), if below count.
#define ELEMENT_STEPS(count) (((count) + THREADS - 1u) / THREADS)
