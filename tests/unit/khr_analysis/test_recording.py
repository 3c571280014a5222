"""What a bag says of itself."""

import yaml

from khr_analysis.recording import Recording


def test_metadata_names_the_distribution_and_what_was_offered(tmp_path):
    recording = Recording(tmp_path / 'bag')
    recording.add_topic('/imu/data_raw', 'sensor_msgs/msg/Imu')
    recording.write_text('/scenario', 'text', 0)
    recording.close()
    text = (tmp_path / 'bag' / 'metadata.yaml').read_text()
    information = yaml.safe_load(text)['rosbag2_bagfile_information']
    assert information['ros_distro'] == 'jazzy'
    depths = {
        each['topic_metadata']['name']: each['topic_metadata']['offered_qos_profiles'][0]['depth']
        for each in information['topics_with_message_count']
    }
    assert depths == {'/imu/data_raw': 500, '/scenario': 1}
    assert b'ros_distro: rosbags' not in (tmp_path / 'bag' / 'bag.mcap').read_bytes()
