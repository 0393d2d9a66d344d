// A peer on Fast DDS for tests, with the conventions of rmw_fastrtps.
//
//   fast_peer DOMAIN udp|shm pub TOPIC TYPE COUNT SIZE PERIOD_US reliable|latched
//   fast_peer DOMAIN udp|shm sub TOPIC TYPE reliable|latched
//   fast_peer DOMAIN udp|shm server SERVICE TYPE
//   fast_peer DOMAIN udp|shm client SERVICE TYPE COUNT
//
// Messages are CDR: a number, and a sequence of octets, each equal to the number modulo 256. Services add two
// 64-bit numbers. The peer ends when its standard input ends.
#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstdio>
#include <cstring>
#include <iostream>
#include <map>
#include <mutex>
#include <thread>
#include <vector>

#include <fastdds/dds/domain/DomainParticipant.hpp>
#include <fastdds/dds/domain/DomainParticipantFactory.hpp>
#include <fastdds/dds/publisher/DataWriter.hpp>
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
  DataWriter* writer(const std::string& name, const std::string& type, Qos qos) {
    DataWriterQos wanted;
    apply(wanted, qos);
    wanted.publish_mode().kind = ASYNCHRONOUS_PUBLISH_MODE;
    return publisher->create_datawriter(topic(name, type), wanted);
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
      if (changed.wait_for(held, std::chrono::seconds(20), [&] { return replies.count(sequence); }))
        right += replies[sequence] == number + 1000;
    }
    std::printf("right %d\n", right);
    wait_for_end();
  } else {
    return 2;
  }
}
