# Draws model.glb through one of its cameras to picture.png (Godot 3). See docs/engines.md.
extends Spatial

const CAMERA = 3

func _ready():
	var soup = read_extension("res://model.glb")
	var model = load("res://model.glb").instance()
	add_child(model)
	var mesh = find_mesh(model)
	for i in range(mesh.mesh.get_surface_count()):
		mesh.mesh.surface_get_material(i).flags_unshaded = true  # the importer does not know KHR_materials_unlit
	add_camera(soup, soup["cameras"][CAMERA], mesh)
	for _i in range(4):
		yield(get_tree(), "idle_frame")
	yield(VisualServer, "frame_post_draw")
	var image = get_viewport().get_texture().get_data()
	image.flip_y()
	image.save_png("res://picture.png")
	get_tree().quit()

func read_extension(path):
	var file = File.new()
	file.open(path, File.READ)
	file.seek(12)
	var length = file.get_32()
	file.get_32()
	var document = JSON.parse(file.get_buffer(length).get_string_from_utf8()).result
	return document["extensions"]["TRISOUP_neural_textures"]

func find_mesh(node):
	if node is MeshInstance:
		return node
	for child in node.get_children():
		var found = find_mesh(child)
		if found:
			return found
	return null

func add_camera(soup, photograph, mesh):
	var w = photograph["world_to_camera"]
	var turn = Basis(Vector3(w[0], w[4], w[8]), Vector3(w[1], w[5], w[9]), Vector3(w[2], w[6], w[10]))
	var pose = Transform(turn, Vector3(w[3], w[7], w[11])).affine_inverse()
	var centre = soup["centre"]
	pose.origin = pose.origin / soup["scale"] + Vector3(centre[0], centre[1], centre[2])
	pose.basis = pose.basis * Basis(Vector3(1, 0, 0), Vector3(0, -1, 0), Vector3(0, 0, -1))
	var camera = Camera.new()
	add_child(camera)
	camera.global_transform = mesh.global_transform * pose
	camera.fov = rad2deg(2 * atan(0.5 * photograph["size"][1] / photograph["focal"][1]))
	camera.near = 0.01 / soup["scale"]
	camera.far = 10 / soup["scale"]
	camera.current = true
	camera.environment = Environment.new()
	camera.environment.background_mode = Environment.BG_COLOR
	var colour = soup["background"]
	camera.environment.background_color = Color(colour[0], colour[1], colour[2])
