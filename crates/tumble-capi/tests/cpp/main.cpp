// The interface from C++17: what C++ firmware does with it, held against the same vectors.

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <iterator>
#include <memory>
#include <new>
#include <stdexcept>
#include <string>
#include <type_traits>
#include <vector>

#include <cjson/cJSON.h>

#include "tumble.hpp"

static_assert(sizeof(tumble_status) == 4 && sizeof(tumble_sensor) == 4, "enumerations have a fixed size");
static_assert(std::is_trivially_copyable_v<tumble_spin>, "storage may be moved");
static_assert(alignof(tumble_redundancy) == 8, "storage is aligned to words");

namespace {

void require(bool holds, const std::string &law)
{
    if (!holds) {
        throw std::runtime_error(law);
    }
}

void done(tumble_status status)
{
    require(status == TUMBLE_OK, tumble_strerror(status));
}

using Json = std::unique_ptr<cJSON, decltype(&cJSON_Delete)>;

Json read(const std::string &path)
{
    std::ifstream file(path);
    const std::string text{std::istreambuf_iterator<char>(file), {}};
    Json json(cJSON_Parse(text.c_str()), cJSON_Delete);
    require(json != nullptr, "cannot read " + path);
    return json;
}

const cJSON *member(const cJSON *object, const char *name)
{
    const cJSON *found = cJSON_GetObjectItemCaseSensitive(object, name);
    require(found != nullptr, std::string("no member ") + name);
    return found;
}

/// All numbers of a value, row by row.
std::vector<double> numbers(const cJSON *value)
{
    if (cJSON_IsNumber(value)) {
        return {value->valuedouble};
    }
    std::vector<double> all;
    const cJSON *part = nullptr;
    cJSON_ArrayForEach(part, value)
    {
        const auto more = numbers(part);
        all.insert(all.end(), more.begin(), more.end());
    }
    require(!all.empty(), "no numbers");
    return all;
}

tumble_error_model model_of(const cJSON *a_case)
{
    tumble_error_model model{};
    const auto m = numbers(member(a_case, "M"));
    const auto b = numbers(member(a_case, "b"));
    for (std::size_t i = 0; i < 9; ++i) {
        model.matrix[i / 3][i % 3] = static_cast<float>(m.at(i));
    }
    std::transform(b.begin(), b.end(), model.bias, [](double x) { return static_cast<float>(x); });
    return model;
}

void readings_are_corrected_as_the_vectors_say(const std::string &folder)
{
    const Json file = read(folder + "/model.json");
    const double allowed = numbers(member(member(member(file.get(), "tolerance"), "corrected"), "f32")).at(0);
    const cJSON *a_case = nullptr;
    int cases = 0;
    cJSON_ArrayForEach(a_case, member(file.get(), "cases"))
    {
        const tumble_error_model model = model_of(a_case);
        const tumble_calibration calibration{model, model};
        tumble_correction correction{};
        done(tumble_correction_init(&correction, &calibration));
        tumble_sample sample{};
        const auto reading = numbers(member(a_case, "y"));
        const auto expected = numbers(member(a_case, "corrected"));
        for (std::size_t i = 0; i < 3; ++i) {
            sample.specific_force[i] = sample.angular_rate[i] = static_cast<float>(reading.at(i));
        }
        done(tumble_correction_apply(&correction, &sample, &sample));
        for (std::size_t i = 0; i < 3; ++i) {
            const double force = sample.specific_force[i];
            const double rate = sample.angular_rate[i];
            require(std::abs(force - expected.at(i)) <= allowed && force == rate, "corrected");
        }
        ++cases;
    }
    require(cases > 0, "no cases");
}

/// Hears events as C++ likes to: by anything that can be called.
struct Mission {
    std::vector<tumble_event_kind> kinds;
    std::vector<tumble_record> records;

    static void on_event(void *context, const tumble_event *event) noexcept
    {
        auto &mission = *static_cast<Mission *>(context);
        if (event->unit > 1) {
            return; // The vectors have two units; any others never send a sample.
        }
        if (event->kind == TUMBLE_EVENT_KIND_ADOPTED) {
            mission.records.push_back(*event->record);
        }
        mission.kinds.push_back(event->kind);
    }
};

std::unique_ptr<tumble_redundancy> monitor_of(const cJSON *cases)
{
    tumble_redundancy_settings settings{};
    done(tumble_redundancy_defaults(&settings));
    settings.rest_duration = static_cast<std::uint64_t>(numbers(member(cases, "rest_duration_s")).at(0) * 1e6);
    settings.collect = static_cast<std::uint64_t>(numbers(member(cases, "collect_s")).at(0) * 1e6);
    std::array<tumble_unit, TUMBLE_UNITS> units{};
    std::uint64_t identity = 1;
    for (auto &unit : units) {
        done(tumble_unit_defaults(&unit, identity++));
    }
    auto monitor = std::make_unique<tumble_redundancy>();
    done(tumble_redundancy_init(monitor.get(), sizeof *monitor, &settings, nullptr, units.data(), units.size()));
    return monitor;
}

void secondaries_are_calibrated_as_the_vectors_say(const std::string &folder)
{
    const Json file = read(folder + "/redundancy.json");
    const cJSON *cases = member(file.get(), "cases");
    const auto monitor = monitor_of(cases);
    const double interval = numbers(member(cases, "interval_us")).at(0);
    const double steps[2] = {numbers(member(cases, "force_step")).at(0), numbers(member(cases, "rate_step")).at(0)};
    const std::array<std::vector<double>, 2> counts{numbers(member(cases, "primary_counts")),
                                                    numbers(member(cases, "secondary_counts"))};
    Mission mission;
    for (std::size_t k = 0; k < counts[0].size() / 6; ++k) {
        for (std::uint32_t unit = 0; unit < 2; ++unit) {
            tumble_sample sample{};
            sample.time = 1000000 + k * static_cast<std::uint64_t>(interval);
            for (std::size_t i = 0; i < 3; ++i) {
                sample.specific_force[i] =
                    static_cast<float>(counts[unit].at(6 * k + i)) * static_cast<float>(steps[0]);
                sample.angular_rate[i] =
                    static_cast<float>(counts[unit].at(6 * k + 3 + i)) * static_cast<float>(steps[1]);
            }
            done(tumble_redundancy_push(monitor.get(), unit, &sample, Mission::on_event, &mission, nullptr));
        }
    }
    require(mission.records.size() == 2, "both sensors are adopted");
    require(mission.kinds.front() == TUMBLE_EVENT_KIND_SELECTED, "the primary is selected first");
    for (const auto &record : mission.records) {
        const bool gyroscope = record.sensor == TUMBLE_SENSOR_GYROSCOPE;
        const char *name = gyroscope ? "gyroscope_b" : "accelerometer_b";
        const auto expected = numbers(member(cases, name));
        const double allowed = numbers(member(member(member(file.get(), "tolerance"), name), "f32")).at(0);
        for (std::size_t i = 0; i < 3; ++i) {
            require(std::abs(record.bias[i] - expected.at(i)) <= allowed * record.bias_sigma[i], name);
        }
        std::array<std::uint8_t, TUMBLE_RECORD_BYTES> bytes{};
        std::size_t length = 0;
        done(tumble_record_encode(&record, bytes.data(), bytes.size(), &length));
        tumble_record back{};
        done(tumble_record_decode(bytes.data(), length, &back));
        require(back.sequence == record.sequence && back.matrix[2][1] == record.matrix[2][1], "round trip");
        bytes.at(20) ^= 1;
        require(tumble_record_decode(bytes.data(), length, &back) == TUMBLE_ERROR_CORRUPT, "a flipped bit is seen");
    }
}

/// Flash as an object, behind callbacks of C.
class Flash {
public:
    static constexpr std::uint32_t page = 1024;

    tumble_flash driver() noexcept
    {
        return {this, &Flash::read, &Flash::write, &Flash::erase, page};
    }

    static constexpr std::uint32_t size() noexcept
    {
        return 4 * page;
    }

private:
    static int read(void *context, std::uint32_t address, std::uint8_t *bytes, std::uint32_t length) noexcept
    {
        std::copy_n(static_cast<Flash *>(context)->memory_.begin() + address, length, bytes);
        return 0;
    }

    static int write(void *context, std::uint32_t address, const std::uint8_t *bytes, std::uint32_t length) noexcept
    {
        std::copy_n(bytes, length, static_cast<Flash *>(context)->memory_.begin() + address);
        return 0;
    }

    static int erase(void *context, std::uint32_t address) noexcept
    {
        std::fill_n(static_cast<Flash *>(context)->memory_.begin() + address, page, std::uint8_t{0xFF});
        return 0;
    }

    std::array<std::uint8_t, 4 * page> memory_{};
};

void records_outlast_the_store_that_wrote_them(const std::string &)
{
    Flash flash;
    tumble_record record{};
    record.identity = 7;
    record.matrix[0][0] = record.matrix[1][1] = record.matrix[2][2] = 1.0F;
    record.sequence = 3;
    for (int resets = 0; resets < 2; ++resets) {
        const tumble_flash driver = flash.driver();
        auto store = std::make_unique<tumble_store>();
        done(tumble_store_init(store.get(), sizeof *store, &driver, 0, Flash::size(), nullptr));
        tumble_record found{};
        const auto status = tumble_store_load(store.get(), 7, TUMBLE_SENSOR_ACCELEROMETER, TUMBLE_WHICH_IN_FORCE, &found);
        require(status == (resets == 0 ? TUMBLE_ERROR_NOTHING_STORED : TUMBLE_OK), tumble_strerror(status));
        require(found.sequence == (resets == 0 ? 0U : 3U), "what was stored is there");
        done(tumble_store_save(store.get(), 0, &record, nullptr));
    }
}

/// Flash as the wrapper takes it, one word of which cannot be read.
struct FlashWithDeadWord {
    static constexpr std::uint32_t page = 1024;
    std::array<std::uint8_t, 4 * page> memory{};

    bool read(std::uint32_t address, tumble::span<std::uint8_t> bytes) noexcept
    {
        std::copy_n(memory.begin() + address, bytes.size(), bytes.begin());
        return address > dead || address + bytes.size() <= dead;
    }

    bool write(std::uint32_t address, tumble::span<const std::uint8_t> bytes) noexcept
    {
        std::copy(bytes.begin(), bytes.end(), memory.begin() + address);
        return true;
    }

    bool erase(std::uint32_t address) noexcept
    {
        std::fill_n(memory.begin() + address, page, std::uint8_t{0xFF});
        return true;
    }

    static constexpr std::uint32_t dead = 320;
};

tumble_record some_record(std::uint64_t identity)
{
    tumble_record record{};
    record.identity = identity;
    record.matrix[0][0] = record.matrix[1][1] = record.matrix[2][2] = 1.0F;
    return record;
}

void objects_keep_records_and_read_their_bytes(const std::string &)
{
    require(tumble::is_compatible(), "header and library are of one version");
    FlashWithDeadWord flash;
    const tumble_flash driver = tumble::flash_of(flash);
    for (std::uint32_t number = 1; number < 40; ++number) {
        tumble::store store(driver, 0, 4 * FlashWithDeadWord::page);
        done(store.status());
        const auto before = store.load(7, TUMBLE_SENSOR_GYROSCOPE);
        require(before.status() == (number == 1 ? TUMBLE_ERROR_NOTHING_STORED : TUMBLE_OK), "the one before is there");
        require(number == 1 || before->sequence == number - 1, "and is the last");
        tumble_record record = some_record(7);
        record.sensor = TUMBLE_SENSOR_GYROSCOPE;
        record.sequence = number;
        done(store.save(0, record));
    }
    std::vector<std::uint8_t> buffer(TUMBLE_RECORD_BYTES);
    const auto bytes = tumble::encode(some_record(9), buffer);
    done(bytes.status());
    require(tumble::decode(*bytes)->identity == 9, "bytes are read back");
    require(tumble::encode(some_record(9), tumble::span<std::uint8_t>(buffer).first(20)).status() == TUMBLE_ERROR_NO_ROOM, "no room");
}

std::vector<std::uint8_t> bytes_of(const std::string &digits)
{
    std::vector<std::uint8_t> bytes;
    for (std::size_t at = 0; at < digits.size(); at += 2) {
        bytes.push_back(static_cast<std::uint8_t>(std::stoi(digits.substr(at, 2), nullptr, 16)));
    }
    return bytes;
}

/// Numbers of a vector in the axes of a sensor.
std::array<float, 3> three(const cJSON *value)
{
    const auto found = numbers(value);
    return {static_cast<float>(found.at(0)), static_cast<float>(found.at(1)), static_cast<float>(found.at(2))};
}

void magnetometers_agree_with_their_vectors_and_outlast_a_reset(const std::string &folder)
{
    const Json file = read(folder + "/magnetometer.json");
    const double allowed = numbers(member(member(member(file.get(), "tolerance"), "field"), "f32")).at(0);
    FlashWithDeadWord flash;
    const tumble_flash driver = tumble::flash_of(flash);
    const cJSON *a_case = nullptr;
    int cases = 0;
    cJSON_ArrayForEach(a_case, member(file.get(), "cases"))
    {
        const auto stated = bytes_of(member(a_case, "record")->valuestring);
        const auto record = tumble::decode_magnetometer(stated);
        done(record.status());
        tumble::store store(driver, 0, 4 * FlashWithDeadWord::page);
        done(store.save_factory_magnetometer(0, *record));
        done(store.save_magnetometer(0, *record));
        tumble::store later(driver, 0, 4 * FlashWithDeadWord::page);
        const auto kept = later.load_magnetometer(record->identity);
        done(kept.status());
        done(later.roll_back_magnetometer(0, record->identity, TUMBLE_WHICH_FACTORY).status());
        std::array<std::uint8_t, TUMBLE_MAGNETOMETER_BYTES> buffer{};
        const auto bytes = tumble::encode(*kept, buffer);
        done(bytes.status());
        require(std::equal(bytes->begin(), bytes->end(), stated.begin(), stated.end()), "its bytes are the same");
        require(tumble::encode(*kept, tumble::span<std::uint8_t>(buffer).first(124)).status() == TUMBLE_ERROR_NO_ROOM, "no room");
        const auto correction = tumble::correction_of(kept->magnetometer);
        const auto load = static_cast<float>(numbers(member(a_case, "load")).at(0));
        const auto field = tumble::corrected(*correction, three(member(a_case, "y")), load);
        done(field.status());
        const auto expected = numbers(member(a_case, "field"));
        for (std::size_t i = 0; i < 3; ++i) {
            require(std::abs((*field)[i] - expected.at(i)) <= allowed, "corrected");
        }
        ++cases;
    }
    require(cases > 0, "no cases");
}

void objects_end_with_their_storage_cleared(const std::string &)
{
    alignas(tumble::redundancy) std::array<unsigned char, sizeof(tumble::redundancy)> room{};
    std::array<tumble_unit, TUMBLE_UNITS> units{};
    for (std::size_t i = 0; i < units.size(); ++i) {
        units[i] = *tumble::unit_defaults(i + 1);
    }
    const auto settings = tumble::redundancy_defaults();
    auto *monitor = new (room.data()) tumble::redundancy(*settings, units);
    done(monitor->status());
    tumble_sample sample{};
    sample.time = 1000;
    sample.specific_force[2] = 9.8F;
    int events = 0;
    const auto output = monitor->push(0, sample, [&](const tumble_event &) noexcept { ++events; });
    require(output && events > 0 && *monitor->source() == 0, "the primary is the source");
    auto *storage = monitor->get();
    monitor->~redundancy();
    std::uint32_t unit = 0;
    require(tumble_redundancy_get_source(storage, &unit) == TUMBLE_ERROR_NOT_INITIALISED, "it is gone");
    auto other = *settings;
    other.version += 1;
    require(tumble::redundancy(other, units).status() == TUMBLE_ERROR_SIZE, "another layout is refused");
}

struct Law {
    const char *sentence;
    void (*hold)(const std::string &);
};

constexpr Law laws[] = {
    {"readings are corrected as the vectors say", readings_are_corrected_as_the_vectors_say},
    {"secondaries are calibrated as the vectors say", secondaries_are_calibrated_as_the_vectors_say},
    {"records outlast the store that wrote them", records_outlast_the_store_that_wrote_them},
    {"objects keep records and read their bytes", objects_keep_records_and_read_their_bytes},
    {"magnetometers agree with their vectors, and outlast a reset", magnetometers_agree_with_their_vectors_and_outlast_a_reset},
    {"objects end with their storage cleared", objects_end_with_their_storage_cleared},
};

} // namespace

int main(int count, char **arguments)
{
    if (count != 2) {
        std::fputs("usage: laws FOLDER_OF_VECTORS\n", stderr);
        return 2;
    }
    int broken = 0;
    for (const auto &law : laws) {
        try {
            law.hold(arguments[1]);
            std::printf("holds: %s\n", law.sentence);
        } catch (const std::exception &error) {
            std::printf("BROKEN: %s: %s\n", law.sentence, error.what());
            ++broken;
        }
    }
    return broken;
}
