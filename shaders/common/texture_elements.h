// How threads share the vectors of a texture among them where each vector is read, changed and written by itself.
#ifdef LANES_OF_A_CPU
// A lane takes a component: lanes side by side take words side by side. As many threads as there are lanes, so that
// none waits for another at a barrier.
#define THREADS LANES_OF_A_CPU
const uint kNumbers = 1u;  // in an element
#define FLOATS float
#define UINTS uint
#define NUMBER(element, c) element
#define ELEMENT(vectors, first, e) vectors[(first) + ((e) >> 2)][(e)&3u]
#define ELEMENT_OF(i, count) ((i)*THREADS + thread)
#define SHARED_VECTORS(word, vector, name, count) SHARED word name[(count)*4u]
#define SHARED_ELEMENT(vectors, e) vectors[e]
#define SHARED_WORD(vectors, i, c) vectors[(i)*4u + (c)]
#else
// A thread takes a vector. Eight neighbouring threads take eight neighbouring ones and go on with the next: whole cache
// lines for a GPU, one stream of memory for a driver that runs eight threads as one.
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
const uint kElements = 8u / kNumbers;  // of a sample: features 0..6 and opacity
/// ELEMENT(vectors, first, e): element e of those from vector `first` on, in memory; SHARED_ELEMENT(vectors, e): of
/// all, in shared memory, and SHARED_WORD component c of vector i there. Element ELEMENT_OF(i, count), if below count,
/// is the thread's, for i below ELEMENT_STEPS(count).
#define ELEMENT_STEPS(count) (((count) + THREADS - 1u) / THREADS)
