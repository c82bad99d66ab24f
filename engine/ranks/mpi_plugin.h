/* The few calls of MPI that ranks need, as a table of C functions: what is built against one MPI library
   (mpi_plugin.c), and loaded by a program that knows none (launched.cpp). */
#ifndef TRISOUP_MPI_PLUGIN_H
#define TRISOUP_MPI_PLUGIN_H

#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

#define TRISOUP_MPI_PLUGIN_VERSION 1

struct TrisoupMpi {
  uint32_t version; /* TRISOUP_MPI_PLUGIN_VERSION of its source */
  int rank, size;
  const char* library; /* name and version, for people */
  /* Sends send[r], of send_bytes[r] bytes, to rank r, and receives receive_bytes[r] bytes from it in receive[r], for
     every r but its own rank. Null, or what is wrong. */
  const char* (*exchange)(const void* const* send, const uint64_t* send_bytes, void* const* receive,
                          const uint64_t* receive_bytes);
  /* Ends MPI. Waits for the other ranks. */
  void (*finish)(void);
};

/* Starts MPI. Null where that fails; *error then says why. */
const struct TrisoupMpi* trisoup_mpi_open(const char** error);
typedef const struct TrisoupMpi* (*TrisoupMpiOpen)(const char** error);

#ifdef __cplusplus
}
#endif
#endif
