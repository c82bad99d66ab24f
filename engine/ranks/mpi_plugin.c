/* The MPI plugin. Built once for each MPI library that CMake finds, into a separate file next to the programs. */
#include "mpi_plugin.h"

#include <mpi.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

static MPI_Comm ranks;
static char text[MPI_MAX_ERROR_STRING];
static char library[MPI_MAX_LIBRARY_VERSION_STRING];
static struct TrisoupMpi table;

static const char* message_of(int code) {
  int length = 0;
  if (MPI_Error_string(code, text, &length) != MPI_SUCCESS) return "unknown MPI error";
  return text;
}

/* MPI counts bytes in int, so longer messages are sent in pieces. Pieces arrive in order. */
static const uint64_t kPiece = 1u << 30;

static uint64_t pieces_of(uint64_t bytes) { return (bytes + kPiece - 1) / kPiece; }

/* MPI libraries wait in a busy loop, which is fastest with one core per rank. A rank that waits for long sleeps between
   polls, so that ranks on the same core can compute. */
static int wait_all(int count, MPI_Request* requests) {
  const struct timespec nap = {0, 50000};
  for (long turn = 0;; ++turn) {
    int done = 0;
    const int code = MPI_Testall(count, requests, &done, MPI_STATUSES_IGNORE);
    if (code != MPI_SUCCESS || done) return code;
    if (turn > 1000) nanosleep(&nap, NULL);
  }
}

static const char* exchange(const void* const* send, const uint64_t* send_bytes, void* const* receive,
                            const uint64_t* receive_bytes) {
  uint64_t most = 0;
  for (int r = 0; r < table.size; ++r) most += pieces_of(send_bytes[r]) + pieces_of(receive_bytes[r]);
  MPI_Request* requests = malloc((most + 1) * sizeof *requests);
  if (!requests) return "out of memory";
  int count = 0, code = MPI_SUCCESS;
  for (int i = 1; i < table.size && code == MPI_SUCCESS; ++i) {
    /* Ranks start with different partners, so that they do not all send to the same rank. */
    const int from = (table.rank + table.size - i) % table.size, to = (table.rank + i) % table.size;
    for (uint64_t at = 0; at < receive_bytes[from] && code == MPI_SUCCESS; at += kPiece) {
      const uint64_t left = receive_bytes[from] - at;
      code = MPI_Irecv((char*)receive[from] + at, (int)(left < kPiece ? left : kPiece), MPI_BYTE, from, 0, ranks,
                       &requests[count++]);
    }
    for (uint64_t at = 0; at < send_bytes[to] && code == MPI_SUCCESS; at += kPiece) {
      const uint64_t left = send_bytes[to] - at;
      code = MPI_Isend((const char*)send[to] + at, (int)(left < kPiece ? left : kPiece), MPI_BYTE, to, 0, ranks,
                       &requests[count++]);
    }
  }
  if (code == MPI_SUCCESS) code = wait_all(count, requests);
  free(requests);
  return code == MPI_SUCCESS ? NULL : message_of(code);
}

static void finish(void) {
  MPI_Comm_free(&ranks);
  MPI_Finalize();
}

const struct TrisoupMpi* trisoup_mpi_open(const char** error) {
  int code = MPI_Init(NULL, NULL), length = 0;
  if (code == MPI_SUCCESS) code = MPI_Comm_dup(MPI_COMM_WORLD, &ranks);
  if (code == MPI_SUCCESS) code = MPI_Comm_set_errhandler(ranks, MPI_ERRORS_RETURN);
  if (code != MPI_SUCCESS) {
    *error = message_of(code);
    return NULL;
  }
  MPI_Comm_rank(ranks, &table.rank);
  MPI_Comm_size(ranks, &table.size);
  MPI_Get_library_version(library, &length);
  library[strcspn(library, ",\n")] = '\0';
  for (char* c = library; *c; ++c)
    if (*c == '\t') *c = ' ';
  table.version = TRISOUP_MPI_PLUGIN_VERSION;
  table.library = library;
  table.exchange = exchange;
  table.finish = finish;
  return &table;
}
