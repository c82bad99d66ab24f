/* The MPI calls that ranks need, as a table of C functions. mpi_plugin.c implements it for one MPI library.
   launched.cpp loads it into programs that are not linked to MPI. */
#ifndef TRISOUP_MPI_PLUGIN_H
#define TRISOUP_MPI_PLUGIN_H

#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

#define TRISOUP_MPI_PLUGIN_VERSION 1

struct TrisoupMpi {
  uint32_t version; /* TRISOUP_MPI_PLUGIN_VERSION when the plugin was built */
  int rank, size;
  const char* library; /* name and version, for messages */
  /* For every rank r except this one, sends send_bytes[r] bytes from send[r] and receives receive_bytes[r] bytes into
     receive[r]. Returns null, or an error message. */
  const char* (*exchange)(const void* const* send, const uint64_t* send_bytes, void* const* receive,
                          const uint64_t* receive_bytes);
  /* Ends MPI. Waits for the other ranks. */
  void (*finish)(void);
};

/* Starts MPI. On failure, returns null and sets *error to a message. */
const struct TrisoupMpi* trisoup_mpi_open(const char** error);
typedef const struct TrisoupMpi* (*TrisoupMpiOpen)(const char** error);

#ifdef __cplusplus
}
#endif
#endif
