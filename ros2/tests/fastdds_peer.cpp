// Carries messages as bytes between Fast DDS and a program: the library under ROS's own middleware.
//
// fastdds_peer DOMAIN ENDPOINT... with ENDPOINT sub:TOPIC:TYPE, late:TOPIC:TYPE (transient local) or
// cli:SERVICE:TYPE (a client, as rmw_fastrtps maps services). Standard input: `SERVICE HEX` sends a
// request. Standard output: `match NAME`, `sent SERVICE NUMBER`, `got NAME NUMBER HEX`.
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
#include <fastrtps/utils/IPLocator.h>

#include <cstring>
#include <iostream>
#include <map>
#include <memory>
#include <mutex>
#include <sstream>
#include <string>
#include <vector>

namespace fast = eprosima::fastdds::dds;
namespace rtps = eprosima::fastrtps::rtps;
using Bytes = std::vector<unsigned char>;

std::mutex output;

void say(const std::string& line) {
    std::lock_guard<std::mutex> lock(output);
    std::cout << line << std::endl;
}

std::string hex(const Bytes& bytes) {
    static const char* digits = "0123456789abcdef";
    std::string text;
    for (unsigned char byte : bytes) {
        text += digits[byte >> 4];
        text += digits[byte & 15];
    }
    return text;
}

Bytes unhex(const std::string& text) {
    Bytes bytes;
    for (size_t at = 0; at + 1 < text.size(); at += 2) {
        bytes.push_back(static_cast<unsigned char>(std::stoi(text.substr(at, 2), nullptr, 16)));
    }
    return bytes;
}

// A message of any type, as its bytes with the four that name the encoding.
class AnyType : public fast::TopicDataType {
public:
    explicit AnyType(const std::string& name) {
        setName(name.c_str());
        m_typeSize = 1 << 20;
        m_isGetKeyDefined = false;
    }
    bool serialize(void* data, rtps::SerializedPayload_t* payload) override {
        const auto& bytes = *static_cast<Bytes*>(data);
        if (bytes.size() > payload->max_size) {
            return false;
        }
        std::memcpy(payload->data, bytes.data(), bytes.size());
        payload->length = static_cast<uint32_t>(bytes.size());
        payload->encapsulation = CDR_LE;
        return true;
    }
    bool deserialize(rtps::SerializedPayload_t* payload, void* data) override {
        static_cast<Bytes*>(data)->assign(payload->data, payload->data + payload->length);
        return true;
    }
    std::function<uint32_t()> getSerializedSizeProvider(void* data) override {
        const auto size = static_cast<uint32_t>(static_cast<Bytes*>(data)->size());
        return [size]() { return size; };
    }
    void* createData() override { return new Bytes; }
    void deleteData(void* data) override { delete static_cast<Bytes*>(data); }
    bool getKey(void*, rtps::InstanceHandle_t*, bool) override { return false; }
};

class Listener : public fast::DataReaderListener {
public:
    explicit Listener(std::string name) : name_(std::move(name)) {}
    void on_data_available(fast::DataReader* reader) override {
        Bytes bytes;
        fast::SampleInfo info;
        while (reader->take_next_sample(&bytes, &info) == ReturnCode_t::RETCODE_OK) {
            if (!info.valid_data) {
                continue;
            }
            const auto number = info.related_sample_identity.sequence_number().to64long();
            say("got " + name_ + " " + std::to_string(number) + " " + hex(bytes));
        }
    }
    void on_subscription_matched(fast::DataReader*, const fast::SubscriptionMatchedStatus& status) override {
        if (status.current_count_change > 0) {
            say("match " + name_);
        }
    }

private:
    std::string name_;
};

class Peer {
public:
    explicit Peer(uint32_t domain) {
        fast::DomainParticipantQos qos;
        rtps::Locator_t loopback;
        for (uint32_t index = 0; index < 10; index++) {
            rtps::IPLocator::setIPv4(loopback, 127, 0, 0, 1);
            loopback.port = 7400 + 250 * domain + 10 + 2 * index;
            qos.wire_protocol().builtin.initialPeersList.push_back(loopback);
        }
        participant_ = fast::DomainParticipantFactory::get_instance()->create_participant(domain, qos);
        publisher_ = participant_->create_publisher(fast::PUBLISHER_QOS_DEFAULT);
        subscriber_ = participant_->create_subscriber(fast::SUBSCRIBER_QOS_DEFAULT);
    }

    fast::DataReader* reader(const std::string& name, const std::string& topic, const std::string& type, bool late) {
        fast::DataReaderQos qos;
        qos.reliability().kind = fast::RELIABLE_RELIABILITY_QOS;
        qos.durability().kind = late ? fast::TRANSIENT_LOCAL_DURABILITY_QOS : fast::VOLATILE_DURABILITY_QOS;
        qos.history().kind = fast::KEEP_LAST_HISTORY_QOS;
        qos.history().depth = 50;
        qos.endpoint().history_memory_policy = rtps::DYNAMIC_RESERVE_MEMORY_MODE;
        listeners_.push_back(std::make_unique<Listener>(name));
        return subscriber_->create_datareader(made(topic, type), qos, listeners_.back().get());
    }

    void client(const std::string& service, const std::string& type) {
        fast::DataWriterQos qos;
        qos.reliability().kind = fast::RELIABLE_RELIABILITY_QOS;
        qos.durability().kind = fast::VOLATILE_DURABILITY_QOS;
        qos.history().kind = fast::KEEP_LAST_HISTORY_QOS;
        qos.history().depth = 10;
        qos.endpoint().history_memory_policy = rtps::DYNAMIC_RESERVE_MEMORY_MODE;
        auto* answers = reader(service, "rr/" + service + "Reply", type + "_Response_", false);
        readers_[service] = answers;
        writers_[service] = publisher_->create_datawriter(made("rq/" + service + "Request", type + "_Request_"), qos);
    }

    void ask(const std::string& service, Bytes bytes) {
        // As rmw_fastrtps: the reader of the answers is named in the request.
        rtps::WriteParams parameters;
        parameters.related_sample_identity().writer_guid(readers_[service]->guid());
        writers_[service]->write(&bytes, parameters);
        say("sent " + service + " " + std::to_string(parameters.sample_identity().sequence_number().to64long()));
    }

private:
    fast::Topic* made(const std::string& topic, const std::string& type) {
        fast::TypeSupport support(new AnyType(type));
        support.register_type(participant_);
        return participant_->create_topic(topic, type, fast::TOPIC_QOS_DEFAULT);
    }

    fast::DomainParticipant* participant_;
    fast::Publisher* publisher_;
    fast::Subscriber* subscriber_;
    std::vector<std::unique_ptr<Listener>> listeners_;
    std::map<std::string, fast::DataReader*> readers_;
    std::map<std::string, fast::DataWriter*> writers_;
};

int main(int count, char** words) {
    Peer peer(static_cast<uint32_t>(std::stoul(words[1])));
    for (int at = 2; at < count; at++) {
        std::istringstream word(words[at]);
        std::string kind, topic, type;
        std::getline(word, kind, ':');
        std::getline(word, topic, ':');
        std::getline(word, type);
        if (kind == "cli") {
            peer.client(topic, type);
        } else {
            peer.reader(topic, topic, type, kind == "late");
        }
    }
    std::string service, text;
    while (std::cin >> service >> text) {
        peer.ask(service, unhex(text));
    }
    std::_Exit(0);
}
