/* A peer on Cyclone DDS for tests, with the conventions of rmw_cyclonedds.
 *
 *   cyclone_peer DOMAIN pub TOPIC COUNT SIZE PERIOD_US reliable|latched
 *   cyclone_peer DOMAIN sub TOPIC reliable|latched
 *   cyclone_peer DOMAIN server SERVICE
 *   cyclone_peer DOMAIN client SERVICE COUNT
 *   cyclone_peer DOMAIN action-server ACTION
 *   cyclone_peer DOMAIN action-client ACTION ORDER finish|cancel
 *
 * Its types are in peer.idl. Each octet of a message equals its number modulo 256. The action computes as many
 * Fibonacci numbers as the order says. It rejects negative orders; orders from 40 on run until they are
 * cancelled. The peer ends when its standard input ends. */
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
#define FIBONACCI(part) example_interfaces_action_dds__Fibonacci_##part##_
#define CANCEL(part) action_msgs_srv_dds__CancelGoal_##part##_
#define STATUSES action_msgs_msg_dds__GoalStatusArray_
#define DESCRIPTOR(type) DESCRIPTOR_OF(type)
#define DESCRIPTOR_OF(type) &type##_desc

static dds_entity_t participant;

static dds_qos_t *make_qos(int latched, int depth, const char *user_data) {
  dds_qos_t *qos = dds_create_qos();
  dds_qset_reliability(qos, DDS_RELIABILITY_RELIABLE, DDS_INFINITY);
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
  dds_publication_matched_status_t status = {0};
  while (dds_get_publication_matched_status(writer, &status), !status.current_count) dds_sleepfor(DDS_MSECS(5));
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
      wait_for_reader(writer); /* otherwise the reply would be lost */
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
    for (int tries = 0; tries < 600; ++tries) {
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

#define ENDLESS 40
#define MAX_GOALS 64
enum { EXECUTING = 2, SUCCEEDED = 4, CANCELED = 5 };

typedef struct {
  uint8_t id[16];
  int32_t order;
  uint8_t status;
  int is_asked; /* a request for the result waits */
  uint64_t client;
  int64_t sequence_number;
} Goal;

static Goal goals[MAX_GOALS];
static uint32_t goal_count;

static Goal *goal_of(const uint8_t *id) {
  for (uint32_t each = 0; each < goal_count; ++each)
    if (!memcmp(goals[each].id, id, 16)) return &goals[each];
  return NULL;
}

static uint32_t fibonacci(int32_t order, int32_t *numbers) {
  for (int32_t each = 0; each < order && each < ENDLESS; ++each)
    numbers[each] = each < 2 ? each : numbers[each - 1] + numbers[each - 2];
  return (uint32_t)(order < ENDLESS ? order : ENDLESS);
}

/* Creates an endpoint of an action: of the service, or of the topic if `prefix` is `rt`. */
static dds_entity_t end_of(const char *prefix, const char *action, const char *part,
                           const dds_topic_descriptor_t *descriptor, int is_writer, const char *id) {
  char name[200];
  snprintf(name, sizeof name, "%s/_action/%s", action, part);
  int is_topic = !strcmp(prefix, "rt"), is_latched = !strcmp(part, "status");
  const char *suffix = is_topic ? "" : !strcmp(prefix, "rq") ? "Request" : "Reply";
  dds_entity_t named = topic(prefix, name, suffix, descriptor);
  dds_qos_t *qos = make_qos(is_latched, is_latched ? 1 : 2000, is_topic ? NULL : id);
  return is_writer ? dds_create_writer(participant, named, qos, NULL)
                   : dds_create_reader(participant, named, qos, NULL);
}

static int take_now(dds_entity_t reader, void **sample) {
  dds_sample_info_t info;
  return dds_take(reader, sample, &info, 1, 1) > 0 && info.valid_data;
}

static void publish_statuses(dds_entity_t writer) {
  action_msgs_msg_dds__GoalStatus_ each[MAX_GOALS] = {0};
  for (uint32_t number = 0; number < goal_count; ++number) {
    memcpy(each[number].goal_info.id, goals[number].id, 16);
    each[number].status = goals[number].status;
  }
  STATUSES statuses = {0};
  statuses.status_list._buffer = each;
  statuses.status_list._length = statuses.status_list._maximum = goal_count;
  dds_write(writer, &statuses);
}

static void answer_if_ended(dds_entity_t writer, Goal *goal) {
  if (!goal->is_asked || goal->status < SUCCEEDED) return;
  int32_t numbers[ENDLESS];
  FIBONACCI(GetResult_Response) response = {goal->client, goal->sequence_number, goal->status, {0}};
  response.numbers._buffer = numbers;
  response.numbers._length = response.numbers._maximum =
      goal->status == SUCCEEDED ? fibonacci(goal->order, numbers) : 0;
  dds_write(writer, &response);
  goal->is_asked = 0;
}

static void serve_action(char **words) {
  const char *id = "serviceid=31.02.03.04.05.06.07.08.09.0a.0b.0c.0d.0e.0f.10;", *name = words[0];
  dds_entity_t feedback = end_of("rt", name, "feedback", DESCRIPTOR(FIBONACCI(FeedbackMessage)), 1, id);
  dds_entity_t status = end_of("rt", name, "status", DESCRIPTOR(STATUSES), 1, id);
  dds_entity_t accepted = end_of("rr", name, "send_goal", DESCRIPTOR(FIBONACCI(SendGoal_Response)), 1, id);
  dds_entity_t cancelled = end_of("rr", name, "cancel_goal", DESCRIPTOR(CANCEL(Response)), 1, id);
  dds_entity_t result = end_of("rr", name, "get_result", DESCRIPTOR(FIBONACCI(GetResult_Response)), 1, id);
  dds_entity_t goal_reader = end_of("rq", name, "send_goal", DESCRIPTOR(FIBONACCI(SendGoal_Request)), 0, id);
  dds_entity_t cancel_reader = end_of("rq", name, "cancel_goal", DESCRIPTOR(CANCEL(Request)), 0, id);
  dds_entity_t result_reader =
      end_of("rq", name, "get_result", DESCRIPTOR(FIBONACCI(GetResult_Request)), 0, id);
  void *sent = calloc(1, sizeof(FIBONACCI(SendGoal_Request))), *asked = calloc(1, sizeof(FIBONACCI(GetResult_Request)));
  void *cancelling = calloc(1, sizeof(CANCEL(Request)));
  puts("ready");
  while (!has_input_ended(1)) {
    if (take_now(goal_reader, &sent)) {
      FIBONACCI(SendGoal_Request) *request = sent;
      int is_accepted = request->order >= 0 && goal_count < MAX_GOALS;
      FIBONACCI(SendGoal_Response) response = {request->client, request->sequence_number, is_accepted, 0, 0};
      dds_write(accepted, &response);
      printf("goal %d\n", request->order);
      if (is_accepted) {
        Goal *goal = &goals[goal_count++];
        *goal = (Goal){.order = request->order, .status = EXECUTING};
        memcpy(goal->id, request->id, 16);
        publish_statuses(status);
        int32_t numbers[ENDLESS];
        uint32_t total = fibonacci(goal->order, numbers);
        FIBONACCI(FeedbackMessage) message = {0};
        memcpy(message.id, goal->id, 16);
        message.numbers._buffer = numbers;
        for (uint32_t length = 1; length <= total; ++length) {
          message.numbers._length = message.numbers._maximum = length;
          dds_write(feedback, &message);
        }
        if (goal->order < ENDLESS) {
          goal->status = SUCCEEDED;
          publish_statuses(status);
        }
      }
    }
    if (take_now(cancel_reader, &cancelling)) {
      CANCEL(Request) *request = cancelling;
      Goal *goal = goal_of(request->id);
      int is_running = goal && goal->status == EXECUTING;
      CANCEL(Response) response = {request->client, request->sequence_number, is_running ? 0 : 2, {0}};
      action_msgs_msg_dds__GoalInfo_ info = {0};
      memcpy(info.id, request->id, 16);
      response.goals_canceling._buffer = &info;
      response.goals_canceling._length = response.goals_canceling._maximum = (uint32_t)is_running;
      dds_write(cancelled, &response);
      if (is_running) {
        goal->status = CANCELED;
        publish_statuses(status);
        answer_if_ended(result, goal);
      }
    }
    if (take_now(result_reader, &asked)) {
      FIBONACCI(GetResult_Request) *request = asked;
      Goal *goal = goal_of(request->id);
      if (goal) {
        goal->is_asked = 1;
        goal->client = request->client;
        goal->sequence_number = request->sequence_number;
        answer_if_ended(result, goal);
      }
    }
  }
}

static void wait_for_reader_and_writer(dds_entity_t writer, dds_entity_t reader) {
  dds_subscription_matched_status_t status = {0};
  if (writer) wait_for_reader(writer);
  while (reader && !status.current_count) {
    dds_sleepfor(DDS_MSECS(5));
    dds_get_subscription_matched_status(reader, &status);
  }
}

static void call_action(char **words) {
  const char *id = "clientid=41.12.13.14.15.16.17.18.19.1a.1b.1c.1d.1e.1f.20;", *name = words[0];
  int is_cancelled = !strcmp(words[2], "cancel");
  dds_entity_t feedback = end_of("rt", name, "feedback", DESCRIPTOR(FIBONACCI(FeedbackMessage)), 0, id);
  dds_entity_t status = end_of("rt", name, "status", DESCRIPTOR(STATUSES), 0, id);
  dds_entity_t accepted = end_of("rr", name, "send_goal", DESCRIPTOR(FIBONACCI(SendGoal_Response)), 0, id);
  dds_entity_t cancelled = end_of("rr", name, "cancel_goal", DESCRIPTOR(CANCEL(Response)), 0, id);
  dds_entity_t result = end_of("rr", name, "get_result", DESCRIPTOR(FIBONACCI(GetResult_Response)), 0, id);
  dds_entity_t goal_writer = end_of("rq", name, "send_goal", DESCRIPTOR(FIBONACCI(SendGoal_Request)), 1, id);
  dds_entity_t cancel_writer = end_of("rq", name, "cancel_goal", DESCRIPTOR(CANCEL(Request)), 1, id);
  dds_entity_t result_writer =
      end_of("rq", name, "get_result", DESCRIPTOR(FIBONACCI(GetResult_Request)), 1, id);
  wait_for_reader_and_writer(goal_writer, accepted);
  wait_for_reader_and_writer(cancel_writer, cancelled);
  wait_for_reader_and_writer(result_writer, result);
  wait_for_reader_and_writer(0, feedback);
  wait_for_reader_and_writer(0, status);
  FIBONACCI(SendGoal_Request) goal = {4713, 1, {0}, atoi(words[1])};
  CANCEL(Request) cancelling = {4713, 1, {0}, 0, 0};
  FIBONACCI(GetResult_Request) asking = {4713, 1, {0}};
  int32_t process = getpid();
  memcpy(goal.id, &process, sizeof process);
  memcpy(cancelling.id, goal.id, 16);
  memcpy(asking.id, goal.id, 16);
  dds_write(goal_writer, &goal);
  void *reply = calloc(1, sizeof(FIBONACCI(SendGoal_Response))), *ended = calloc(1, sizeof(FIBONACCI(GetResult_Response)));
  void *code = calloc(1, sizeof(CANCEL(Response))), *partial = calloc(1, sizeof(FIBONACCI(FeedbackMessage)));
  void *statuses = calloc(1, sizeof(STATUSES));
  int last = 0;
  while (!has_input_ended(1)) {
    if (take_now(feedback, &partial)) {
      FIBONACCI(FeedbackMessage) *message = partial;
      if (!memcmp(message->id, goal.id, 16)) printf("feedback %u\n", message->numbers._length);
    }
    if (take_now(status, &statuses)) {
      STATUSES *found = statuses;
      for (uint32_t each = 0; each < found->status_list._length; ++each) {
        action_msgs_msg_dds__GoalStatus_ *one = &found->status_list._buffer[each];
        if (!memcmp(one->goal_info.id, goal.id, 16) && one->status != last)
          printf("status %d\n", last = one->status);
      }
    }
    if (take_now(accepted, &reply)) {
      FIBONACCI(SendGoal_Response) *response = reply;
      if (response->client != 4713) continue;
      printf("accepted %d\n", response->accepted);
      if (response->accepted) dds_write(result_writer, &asking);
      if (response->accepted && is_cancelled) dds_write(cancel_writer, &cancelling);
    }
    if (take_now(cancelled, &code)) {
      CANCEL(Response) *response = code;
      if (response->client == 4713)
        printf("cancelling %d of %u\n", response->return_code, response->goals_canceling._length);
    }
    if (take_now(result, &ended)) {
      FIBONACCI(GetResult_Response) *response = ended;
      if (response->client != 4713) continue;
      printf("result %d:", response->status);
      for (uint32_t each = 0; each < response->numbers._length; ++each)
        printf(" %d", response->numbers._buffer[each]);
      puts("");
    }
  }
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
  else if (!strcmp(words[2], "action-server") && count == 4) serve_action(words + 3);
  else if (!strcmp(words[2], "action-client") && count == 6) call_action(words + 3);
  else return 2;
  dds_delete(participant);
  return 0;
}
