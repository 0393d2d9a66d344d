/* A peer on Cyclone DDS for tests, with the conventions of rmw_cyclonedds.
 *
 *   cyclone_peer DOMAIN pub TOPIC COUNT SIZE PERIOD_US reliable|latched
 *   cyclone_peer DOMAIN sub TOPIC reliable|latched
 *   cyclone_peer DOMAIN server SERVICE
 *   cyclone_peer DOMAIN client SERVICE COUNT
 *
 * Its types are in peer.idl. Each octet of a message equals its number modulo 256. The peer ends when its
 * standard input ends. */
#include <dds/dds.h>
#include <fcntl.h>
#include <poll.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "peer.h"

#define BLOB example_interfaces_msg_dds__Blob_
#define REQUEST example_interfaces_srv_dds__AddTwoInts_Request_
#define RESPONSE example_interfaces_srv_dds__AddTwoInts_Response_
#define DESCRIPTOR(type) DESCRIPTOR_OF(type)
#define DESCRIPTOR_OF(type) &type##_desc

static dds_entity_t participant;

static dds_qos_t *make_qos(int latched, int depth, const char *user_data) {
  dds_qos_t *qos = dds_create_qos();
  dds_qset_reliability(qos, DDS_RELIABILITY_RELIABLE, DDS_SECS(1));
  dds_qset_durability(qos, latched ? DDS_DURABILITY_TRANSIENT_LOCAL : DDS_DURABILITY_VOLATILE);
  dds_qset_history(qos, DDS_HISTORY_KEEP_LAST, depth);
  if (user_data) dds_qset_userdata(qos, user_data, strlen(user_data));
  return qos;
}

static dds_entity_t topic(const char *prefix, const char *name, const char *suffix,
                          const dds_topic_descriptor_t *descriptor) {
  char whole[256];
  snprintf(whole, sizeof whole, "%s%s%s", prefix, name, suffix);
  dds_entity_t made = dds_create_topic(participant, descriptor, whole, NULL, NULL);
  if (made < 0) exit(3);
  return made;
}

static int has_input_ended(int timeout_ms) {
  struct pollfd input = {STDIN_FILENO, POLLIN, 0};
  char byte;
  return poll(&input, 1, timeout_ms) > 0 && read(STDIN_FILENO, &byte, 1) <= 0;
}

static void wait_for_end(void) {
  while (!has_input_ended(100)) {
  }
}

static void wait_for_reader(dds_entity_t writer) {
  dds_publication_matched_status_t status;
  do {
    dds_sleepfor(DDS_MSECS(5));
    dds_get_publication_matched_status(writer, &status);
  } while (!status.current_count);
}

static dds_entity_t waitset_of(dds_entity_t reader) {
  dds_entity_t waitset = dds_create_waitset(participant);
  dds_waitset_attach(waitset, dds_create_readcondition(reader, DDS_ANY_STATE), 0);
  return waitset;
}

static int take(dds_entity_t waitset, dds_entity_t reader, void **sample, int timeout_ms) {
  dds_sample_info_t info;
  dds_attach_t triggered;
  if (dds_waitset_wait(waitset, &triggered, 1, DDS_MSECS(timeout_ms)) <= 0) return 0;
  return dds_take(reader, sample, &info, 1, 1) > 0 && info.valid_data ? 1 : 0;
}

static void publish(char **words) {
  int latched = !strcmp(words[4], "latched"), size = atoi(words[2]);
  dds_entity_t writer =
      dds_create_writer(participant, topic("", words[0], "", DESCRIPTOR(BLOB)), make_qos(latched, latched ? 1 : 2000, NULL), NULL);
  BLOB blob = {0};
  puts("ready");
  if (!latched) wait_for_reader(writer);
  blob.data._buffer = malloc((size_t)size + 1);
  blob.data._length = blob.data._maximum = (uint32_t)size;
  for (int number = 0; number < atoi(words[1]); ++number) {
    blob.number = (uint32_t)number;
    memset(blob.data._buffer, number, (size_t)size);
    dds_write(writer, &blob);
    dds_sleepfor(DDS_USECS(atoi(words[3])));
  }
  puts("published");
  wait_for_end();
}

static void subscribe(char **words) {
  dds_entity_t reader = dds_create_reader(participant, topic("", words[0], "", DESCRIPTOR(BLOB)),
                                          make_qos(!strcmp(words[1], "latched"), 2000, NULL), NULL);
  dds_entity_t waitset = waitset_of(reader);
  void *sample = calloc(1, sizeof(BLOB));
  puts("ready");
  while (!has_input_ended(0)) {
    while (take(waitset, reader, &sample, 50)) {
      BLOB *blob = sample;
      int right = 1;
      for (uint32_t each = 0; each < blob->data._length; ++each)
        right &= blob->data._buffer[each] == (uint8_t)blob->number;
      printf("%s %u %u\n", right ? "got" : "wrong", blob->number, blob->data._length);
    }
  }
}

static void serve(char **words) {
  const char *id = "serviceid=01.02.03.04.05.06.07.08.09.0a.0b.0c.0d.0e.0f.10;";
  dds_entity_t writer = dds_create_writer(participant, topic("rr", words[0], "Reply", DESCRIPTOR(RESPONSE)),
                                          make_qos(0, 10, id), NULL);
  dds_entity_t reader = dds_create_reader(participant, topic("rq", words[0], "Request", DESCRIPTOR(REQUEST)),
                                          make_qos(0, 10, id), NULL);
  dds_entity_t waitset = waitset_of(reader);
  void *sample = calloc(1, sizeof(REQUEST));
  puts("ready");
  while (!has_input_ended(0)) {
    while (take(waitset, reader, &sample, 50)) {
      REQUEST *request = sample;
      RESPONSE response = {request->client, request->sequence_number, request->a + request->b};
      dds_write(writer, &response);
    }
  }
}

static void call(char **words) {
  const char *id = "clientid=11.12.13.14.15.16.17.18.19.1a.1b.1c.1d.1e.1f.20;";
  dds_entity_t reader = dds_create_reader(participant, topic("rr", words[0], "Reply", DESCRIPTOR(RESPONSE)),
                                          make_qos(0, 10, id), NULL);
  dds_entity_t writer = dds_create_writer(participant, topic("rq", words[0], "Request", DESCRIPTOR(REQUEST)),
                                          make_qos(0, 10, id), NULL);
  dds_entity_t waitset = waitset_of(reader);
  dds_subscription_matched_status_t status;
  int right = 0;
  void *sample = calloc(1, sizeof(RESPONSE));
  wait_for_reader(writer);
  do {
    dds_sleepfor(DDS_MSECS(5));
    dds_get_subscription_matched_status(reader, &status);
  } while (!status.current_count);
  for (int number = 1; number <= atoi(words[1]); ++number) {
    REQUEST request = {4711, number, number, 1000};
    dds_write(writer, &request);
    for (int tries = 0; tries < 50; ++tries) {
      if (!take(waitset, reader, &sample, 100)) continue;
      RESPONSE *response = sample;
      if (response->client != 4711) {
        puts("reply for another");
      } else if (response->sequence_number == number) {
        right += response->sum == number + 1000;
        break;
      }
    }
  }
  printf("right %d\n", right);
  wait_for_end();
}

int main(int count, char **words) {
  if (count < 4) return 2;
  setvbuf(stdout, NULL, _IOLBF, 0);
  participant = dds_create_participant((dds_domainid_t)atoi(words[1]), NULL, NULL);
  if (participant < 0) return 3;
  if (!strcmp(words[2], "pub") && count == 8) publish(words + 3);
  else if (!strcmp(words[2], "sub") && count == 5) subscribe(words + 3);
  else if (!strcmp(words[2], "server") && count == 4) serve(words + 3);
  else if (!strcmp(words[2], "client") && count == 5) call(words + 3);
  else return 2;
  dds_delete(participant);
  return 0;
}
