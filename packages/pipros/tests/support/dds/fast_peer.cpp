// A peer on Fast DDS for tests, with the conventions of rmw_fastrtps.
//
//   fast_peer DOMAIN udp|shm pub TOPIC TYPE COUNT SIZE PERIOD_US reliable|latched
//   fast_peer DOMAIN udp|shm sub TOPIC TYPE reliable|latched
//   fast_peer DOMAIN udp|shm server SERVICE TYPE
//   fast_peer DOMAIN udp|shm client SERVICE TYPE COUNT
//   fast_peer DOMAIN udp|shm action-server ACTION TYPE
//   fast_peer DOMAIN udp|shm action-client ACTION TYPE ORDER finish|cancel
//
// Messages are CDR: a number, and a sequence of octets, each equal to the number modulo 256. Services add two
// 64-bit numbers. Actions compute as many Fibonacci numbers as the order says; they reject negative orders, and
// orders from 40 on run until they are cancelled. The peer ends when its standard input ends.
#include <algorithm>
#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstdio>
#include <cstring>
#include <iostream>
#include <map>
#include <set>
#include <mutex>
#include <thread>
#include <vector>

#include <poll.h>
#include <unistd.h>

#include <fastdds/dds/domain/DomainParticipant.hpp>
#include <fastdds/dds/domain/DomainParticipantFactory.hpp>
#include <fastdds/dds/publisher/DataWriter.hpp>
#include <fastdds/dds/publisher/DataWriterListener.hpp>
#include <fastdds/dds/publisher/Publisher.hpp>
#include <fastdds/dds/subscriber/DataReader.hpp>
#include <fastdds/dds/subscriber/DataReaderListener.hpp>
#include <fastdds/dds/subscriber/SampleInfo.hpp>
#include <fastdds/dds/subscriber/Subscriber.hpp>
#include <fastdds/dds/topic/TopicDataType.hpp>
#include <fastdds/rtps/common/WriteParams.h>
#include <fastdds/rtps/transport/UDPv4TransportDescriptor.h>

using namespace eprosima::fastdds::dds;
using eprosima::fastrtps::rtps::GUID_t;
using eprosima::fastrtps::rtps::InstanceHandle_t;
using eprosima::fastrtps::rtps::SampleIdentity;
using eprosima::fastrtps::rtps::SerializedPayload_t;
using eprosima::fastrtps::rtps::WriteParams;
using Bytes = std::vector<unsigned char>;

class RawType : public TopicDataType {
 public:
  explicit RawType(const std::string& name) {
    setName(name.c_str());
    m_typeSize = 64;
    m_isGetKeyDefined = false;
    auto_fill_type_object(false);
    auto_fill_type_information(false);
  }
  bool serialize(void* data, SerializedPayload_t* payload) override {
    auto* bytes = static_cast<Bytes*>(data);
    std::memcpy(payload->data, bytes->data(), bytes->size());
    payload->length = static_cast<uint32_t>(bytes->size());
    payload->encapsulation = CDR_LE;
    return true;
  }
  bool deserialize(SerializedPayload_t* payload, void* data) override {
    static_cast<Bytes*>(data)->assign(payload->data, payload->data + payload->length);
    return true;
  }
  std::function<uint32_t()> getSerializedSizeProvider(void* data) override {
    return [data] { return static_cast<uint32_t>(static_cast<Bytes*>(data)->size()); };
  }
  void* createData() override { return new Bytes; }
  void deleteData(void* data) override { delete static_cast<Bytes*>(data); }
  bool getKey(void*, InstanceHandle_t*, bool) override { return false; }
};

template <typename Number>
void append(Bytes& bytes, Number number) {
  auto* start = reinterpret_cast<unsigned char*>(&number);
  bytes.insert(bytes.end(), start, start + sizeof number);
}

template <typename Number>
Number number_at(const Bytes& bytes, size_t offset) {
  Number number{};
  if (offset + sizeof number <= bytes.size()) std::memcpy(&number, bytes.data() + offset, sizeof number);
  return number;
}

Bytes message(uint32_t number, uint32_t size) {
  Bytes bytes{0, 1, 0, 0};
  append(bytes, number);
  append(bytes, size);
  bytes.insert(bytes.end(), size, static_cast<unsigned char>(number));
  return bytes;
}

struct Qos {
  bool latched;
  int depth;
};

template <typename Target>
void apply(Target& target, const Qos& qos) {
  target.reliability().kind = RELIABLE_RELIABILITY_QOS;
  target.durability().kind = qos.latched ? TRANSIENT_LOCAL_DURABILITY_QOS : VOLATILE_DURABILITY_QOS;
  target.history().kind = KEEP_LAST_HISTORY_QOS;
  target.history().depth = qos.depth;
  target.resource_limits().max_samples = 0;
  target.endpoint().history_memory_policy = eprosima::fastrtps::rtps::DYNAMIC_REUSABLE_MEMORY_MODE;
}

class Listener : public DataReaderListener {
 public:
  std::function<void(const Bytes&, const SampleInfo&)> on_sample;
  void on_data_available(DataReader* reader) override {
    Bytes bytes;
    SampleInfo info;
    while (reader->take_next_sample(&bytes, &info) == ReturnCode_t::RETCODE_OK)
      if (info.valid_data) on_sample(bytes, info);
  }
};

// The readers that a writer has matched.
class Matched : public DataWriterListener {
 public:
  void on_publication_matched(DataWriter*, const PublicationMatchedStatus& status) override {
    GUID_t guid;
    iHandle2GUID(guid, status.last_subscription_handle);
    std::lock_guard<std::mutex> guard(lock);
    if (status.current_count_change > 0) readers.insert(guid);
  }
  // Like rmw_fastrtps: a reply that is written before would be lost.
  void wait_for(const GUID_t& guid) {
    for (int each = 0; each < 2000; ++each) {
      {
        std::lock_guard<std::mutex> guard(lock);
        if (readers.count(guid)) return;
      }
      std::this_thread::sleep_for(std::chrono::milliseconds(5));
    }
  }

 private:
  std::mutex lock;
  std::set<GUID_t> readers;
};

struct Peer {
  DomainParticipant* participant;
  Publisher* publisher;
  Subscriber* subscriber;
  std::map<std::string, Topic*> topics;

  Peer(int domain, bool udp_only) {
    DomainParticipantQos qos;
    qos.user_data().setValue({'e', 'n', 'c', 'l', 'a', 'v', 'e', '=', '/', ';', 0});
    if (udp_only) {
      qos.transport().use_builtin_transports = false;
      qos.transport().user_transports.push_back(
          std::make_shared<eprosima::fastdds::rtps::UDPv4TransportDescriptor>());
    }
    participant = DomainParticipantFactory::get_instance()->create_participant(domain, qos);
    publisher = participant->create_publisher(PUBLISHER_QOS_DEFAULT);
    subscriber = participant->create_subscriber(SUBSCRIBER_QOS_DEFAULT);
  }
  Topic* topic(const std::string& name, const std::string& type) {
    TypeSupport(new RawType(type)).register_type(participant);
    return participant->create_topic(name, type, TOPIC_QOS_DEFAULT);
  }
  DataWriter* writer(const std::string& name, const std::string& type, Qos qos, Matched* matched = nullptr) {
    DataWriterQos wanted;
    apply(wanted, qos);
    wanted.publish_mode().kind = ASYNCHRONOUS_PUBLISH_MODE;
    return publisher->create_datawriter(topic(name, type), wanted, matched);
  }
  DataReader* reader(const std::string& name, const std::string& type, Qos qos, Listener* listener) {
    DataReaderQos wanted;
    apply(wanted, qos);
    return subscriber->create_datareader(topic(name, type), wanted, listener);
  }
  ~Peer() {
    participant->delete_contained_entities();
    DomainParticipantFactory::get_instance()->delete_participant(participant);
  }
};

void wait_for_reader(DataWriter* writer) {
  PublicationMatchedStatus status;
  do {
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
    writer->get_publication_matched_status(status);
  } while (status.current_count == 0);
}

void wait_for_end() {
  std::string line;
  while (std::getline(std::cin, line)) {
  }
}

bool has_input_ended(int timeout_ms) {
  pollfd input{STDIN_FILENO, POLLIN, 0};
  char byte;
  return poll(&input, 1, timeout_ms) > 0 && read(STDIN_FILENO, &byte, 1) <= 0;
}

bool take(DataReader* reader, Bytes& bytes, SampleInfo& info) {
  return reader->take_next_sample(&bytes, &info) == ReturnCode_t::RETCODE_OK && info.valid_data;
}

// A service of an action, on the side of the server or of the client.
struct Service {
  Matched* matched = new Matched; // until the process ends
  DataReader* reader;
  DataWriter* writer;

  Service(Peer& peer, const std::string& name, const std::string& type, bool is_server) {
    std::string requests = "rq" + name + "Request", replies = "rr" + name + "Reply";
    reader = peer.reader(is_server ? requests : replies, type + (is_server ? "_Request_" : "_Response_"), {false, 10}, nullptr);
    writer = peer.writer(is_server ? replies : requests, type + (is_server ? "_Response_" : "_Request_"), {false, 10}, matched);
  }
  void wait_for_server() {
    SubscriptionMatchedStatus status;
    wait_for_reader(writer);
    for (; status.current_count == 0; reader->get_subscription_matched_status(status))
      std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
  void call(Bytes request) {
    WriteParams from;
    from.related_sample_identity().writer_guid() = reader->guid();
    writer->write(&request, from);
  }
  bool take_reply(Bytes& bytes) {
    SampleInfo info;
    return take(reader, bytes, info) && info.related_sample_identity.writer_guid() == reader->guid();
  }
  bool take_request(Bytes& bytes, SampleIdentity& client) {
    SampleInfo info;
    if (!take(reader, bytes, info)) return false;
    client = info.sample_identity;
    if (info.related_sample_identity.writer_guid() != GUID_t::unknown())
      client.writer_guid() = info.related_sample_identity.writer_guid();
    return true;
  }
  void reply(Bytes bytes, const SampleIdentity& client) {
    matched->wait_for(client.writer_guid());
    WriteParams to;
    to.related_sample_identity() = client;
    writer->write(&bytes, to);
  }
};

enum Status { EXECUTING = 2, SUCCEEDED = 4, CANCELED = 5 };
constexpr int32_t ENDLESS = 40;
constexpr size_t HEADER = 4, ID = 16;
using Id = std::vector<unsigned char>;

struct Goal {
  Id id;
  int32_t order;
  unsigned char status = EXECUTING;
  bool is_asked = false;
  SampleIdentity client{};
};

Id id_at(const Bytes& bytes) {
  return bytes.size() < HEADER + ID ? Id(ID) : Id(bytes.begin() + HEADER, bytes.begin() + HEADER + ID);
}

void append_numbers(Bytes& bytes, int32_t order) {
  std::vector<int32_t> numbers;
  for (int32_t each = 0; each < std::min(order, ENDLESS); ++each)
    numbers.push_back(each < 2 ? each : numbers[each - 1] + numbers[each - 2]);
  append<uint32_t>(bytes, static_cast<uint32_t>(numbers.size()));
  for (int32_t number : numbers) append(bytes, number);
}

Bytes with_id(const Id& id) {
  Bytes bytes{0, 1, 0, 0};
  bytes.insert(bytes.end(), id.begin(), id.end());
  return bytes;
}

struct Action {
  Service send_goal, cancel_goal, get_result;
  Action(Peer& peer, const std::string& name, const std::string& type, bool is_server)
      : send_goal(peer, name + "/_action/send_goal", type + "_SendGoal", is_server),
        cancel_goal(peer, name + "/_action/cancel_goal", "action_msgs::srv::dds_::CancelGoal", is_server),
        get_result(peer, name + "/_action/get_result", type + "_GetResult", is_server) {}
};

const char* const STATUSES = "action_msgs::msg::dds_::GoalStatusArray_";

void serve_action(Peer& peer, const std::string& name, const std::string& type) {
  DataWriter* feedback = peer.writer("rt" + name + "/_action/feedback", type + "_FeedbackMessage_", {false, 2000});
  DataWriter* status = peer.writer("rt" + name + "/_action/status", STATUSES, {true, 1});
  Action action(peer, name, type, true);
  std::vector<Goal> goals;
  auto publish_statuses = [&] {
    Bytes bytes{0, 1, 0, 0};
    append<uint32_t>(bytes, static_cast<uint32_t>(goals.size()));
    for (const Goal& goal : goals) {
      bytes.insert(bytes.end(), goal.id.begin(), goal.id.end());
      while (bytes.size() % 4) bytes.push_back(0);
      append<int64_t>(bytes, 0);
      bytes.push_back(goal.status);
    }
    status->write(&bytes);
  };
  auto answer_if_ended = [&](Goal& goal) {
    if (!goal.is_asked || goal.status < SUCCEEDED) return;
    Bytes bytes{0, 1, 0, 0, goal.status, 0, 0, 0};
    append_numbers(bytes, goal.status == SUCCEEDED ? goal.order : 0);
    action.get_result.reply(bytes, goal.client);
    goal.is_asked = false;
  };
  auto goal_of = [&](const Id& id) {
    return std::find_if(goals.begin(), goals.end(), [&](const Goal& each) { return each.id == id; });
  };
  std::puts("ready");
  Bytes bytes;
  SampleIdentity client;
  while (!has_input_ended(1)) {
    if (action.send_goal.take_request(bytes, client)) {
      auto order = number_at<int32_t>(bytes, HEADER + ID);
      Bytes reply{0, 1, 0, 0, order >= 0, 0, 0, 0};
      append<int64_t>(reply, 0);
      action.send_goal.reply(reply, client);
      std::printf("goal %d\n", order);
      if (order >= 0) {
        goals.push_back({id_at(bytes), order});
        publish_statuses();
        for (int32_t length = 1; length <= std::min(order, ENDLESS); ++length) {
          Bytes partial = with_id(goals.back().id);
          append_numbers(partial, length);
          feedback->write(&partial);
        }
        if (order < ENDLESS) {
          goals.back().status = SUCCEEDED;
          publish_statuses();
        }
      }
    }
    if (action.cancel_goal.take_request(bytes, client)) {
      auto goal = goal_of(id_at(bytes));
      bool is_running = goal != goals.end() && goal->status == EXECUTING;
      Bytes reply{0, 1, 0, 0, static_cast<unsigned char>(is_running ? 0 : 2), 0, 0, 0};
      append<uint32_t>(reply, is_running);
      if (is_running) {
        reply.insert(reply.end(), goal->id.begin(), goal->id.end());
        append<int64_t>(reply, 0);
        goal->status = CANCELED;
      }
      action.cancel_goal.reply(reply, client);
      if (is_running) {
        publish_statuses();
        answer_if_ended(*goal);
      }
    }
    if (action.get_result.take_request(bytes, client)) {
      auto goal = goal_of(id_at(bytes));
      if (goal != goals.end()) {
        goal->is_asked = true;
        goal->client = client;
        answer_if_ended(*goal);
      }
    }
  }
}

void call_action(Peer& peer, const std::string& name, const std::string& type, int32_t order, bool is_cancelled) {
  DataReader* feedback = peer.reader("rt" + name + "/_action/feedback", type + "_FeedbackMessage_", {false, 2000}, nullptr);
  DataReader* status = peer.reader("rt" + name + "/_action/status", STATUSES, {true, 1}, nullptr);
  Action action(peer, name, type, false);
  for (Service* each : {&action.send_goal, &action.cancel_goal, &action.get_result}) each->wait_for_server();
  for (DataReader* each : {feedback, status})
    for (SubscriptionMatchedStatus found; found.current_count == 0; each->get_subscription_matched_status(found))
      std::this_thread::sleep_for(std::chrono::milliseconds(5));
  Id id(ID);
  auto process = static_cast<int32_t>(getpid());
  std::memcpy(id.data(), &process, sizeof process);
  Bytes goal = with_id(id);
  append(goal, order);
  action.send_goal.call(goal);
  Bytes bytes;
  SampleInfo info;
  int last = 0;
  while (!has_input_ended(1)) {
    if (take(feedback, bytes, info) && id_at(bytes) == id) std::printf("feedback %u\n", number_at<uint32_t>(bytes, HEADER + ID));
    if (take(status, bytes, info)) {
      size_t start = HEADER + 4;
      for (auto left = number_at<uint32_t>(bytes, HEADER); left && start + ID + 9 <= bytes.size(); --left) {
        size_t time = (start + ID + 3) / 4 * 4;
        int found = number_at<unsigned char>(bytes, time + 8);
        if (std::equal(id.begin(), id.end(), bytes.begin() + start) && found != last)
          std::printf("status %d\n", last = found);
        start = time + 9;
      }
    }
    if (action.send_goal.take_reply(bytes)) {
      bool is_accepted = number_at<unsigned char>(bytes, HEADER);
      std::printf("accepted %d\n", is_accepted);
      if (is_accepted) action.get_result.call(with_id(id));
      Bytes cancelling = with_id(id);
      append<int64_t>(cancelling, 0);
      if (is_accepted && is_cancelled) action.cancel_goal.call(cancelling);
    }
    if (action.cancel_goal.take_reply(bytes))
      std::printf("cancelling %d of %u\n", number_at<unsigned char>(bytes, HEADER), number_at<uint32_t>(bytes, HEADER + 4));
    if (action.get_result.take_reply(bytes)) {
      std::printf("result %d:", number_at<unsigned char>(bytes, HEADER));
      for (uint32_t each = 0; each < number_at<uint32_t>(bytes, HEADER + 4); ++each)
        std::printf(" %d", number_at<int32_t>(bytes, HEADER + 8 + 4 * each));
      std::puts("");
    }
  }
}

int main(int count, char** words) {
  if (count < 6) return 2;
  std::setvbuf(stdout, nullptr, _IOLBF, 0);
  Peer peer(std::atoi(words[1]), std::string(words[2]) == "udp");
  std::string mode = words[3], name = words[4], type = words[5];
  Listener listener;
  if (mode == "pub" && count == 10) {
    bool latched = std::string(words[9]) == "latched";
    DataWriter* writer = peer.writer(name, type, {latched, latched ? 1 : 2000});
    std::puts("ready");
    if (!latched) wait_for_reader(writer);
    for (int number = 0; number < std::atoi(words[6]); ++number) {
      Bytes bytes = message(number, std::atoi(words[7]));
      writer->write(&bytes);
      std::this_thread::sleep_for(std::chrono::microseconds(std::atoi(words[8])));
    }
    std::puts("published");
    wait_for_end();
  } else if (mode == "sub" && count == 7) {
    listener.on_sample = [](const Bytes& bytes, const SampleInfo&) {
      auto number = number_at<uint32_t>(bytes, 4), size = number_at<uint32_t>(bytes, 8);
      bool right = bytes.size() >= 12u + size;
      for (size_t each = 12; right && each < 12u + size; ++each)
        right = bytes[each] == static_cast<unsigned char>(number);
      std::printf("%s %u %u\n", right ? "got" : "wrong", number, size);
    };
    peer.reader(name, type, {std::string(words[6]) == "latched", 2000}, &listener);
    std::puts("ready");
    wait_for_end();
  } else if (mode == "server" && count == 6) {
    DataWriter* writer = peer.writer("rr" + name + "Reply", type + "_Response_", {false, 10});
    listener.on_sample = [writer](const Bytes& bytes, const SampleInfo& info) {
      Bytes reply{0, 1, 0, 0};
      append(reply, number_at<int64_t>(bytes, 4) + number_at<int64_t>(bytes, 12));
      WriteParams to;
      to.related_sample_identity() = info.sample_identity;
      if (info.related_sample_identity.writer_guid() != GUID_t::unknown())
        to.related_sample_identity().writer_guid() = info.related_sample_identity.writer_guid();
      std::printf("request of %zu bytes\n", bytes.size());
      writer->write(&reply, to);
    };
    peer.reader("rq" + name + "Request", type + "_Request_", {false, 10}, &listener);
    std::puts("ready");
    wait_for_end();
  } else if (mode == "client" && count == 7) {
    std::mutex lock;
    std::condition_variable changed;
    std::map<uint64_t, int64_t> replies;
    GUID_t mine;
    listener.on_sample = [&](const Bytes& bytes, const SampleInfo& info) {
      std::lock_guard<std::mutex> held(lock);
      if (info.related_sample_identity.writer_guid() != mine) {
        std::puts("reply for another");
        return;
      }
      replies[info.related_sample_identity.sequence_number().to64long()] = number_at<int64_t>(bytes, 4);
      changed.notify_all();
    };
    DataReader* reader = peer.reader("rr" + name + "Reply", type + "_Response_", {false, 10}, &listener);
    mine = reader->guid();
    DataWriter* writer = peer.writer("rq" + name + "Request", type + "_Request_", {false, 10});
    wait_for_reader(writer);
    SubscriptionMatchedStatus status;
    do {
      std::this_thread::sleep_for(std::chrono::milliseconds(5));
      reader->get_subscription_matched_status(status);
    } while (status.current_count == 0);
    int right = 0;
    for (int number = 0; number < std::atoi(words[6]); ++number) {
      Bytes bytes{0, 1, 0, 0};
      append<int64_t>(bytes, number);
      append<int64_t>(bytes, 1000);
      WriteParams from;
      from.related_sample_identity().writer_guid() = mine;
      writer->write(&bytes, from);
      auto sequence = from.sample_identity().sequence_number().to64long();
      std::unique_lock<std::mutex> held(lock);
      if (changed.wait_for(held, std::chrono::seconds(60), [&] { return replies.count(sequence); }))
        right += replies[sequence] == number + 1000;
    }
    std::printf("right %d\n", right);
    wait_for_end();
  } else if (mode == "action-server" && count == 6) {
    serve_action(peer, name, type);
  } else if (mode == "action-client" && count == 8) {
    call_action(peer, name, type, std::atoi(words[6]), std::string(words[7]) == "cancel");
  } else {
    return 2;
  }
}
